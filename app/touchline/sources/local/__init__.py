"""Cameras and files of this machine: Video4Linux, pictures, folders, films."""
