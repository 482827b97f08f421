"""The Small Size League's messages, with Google's Protocol Buffers.

ssl_vision.proto       what stands in them; ssl_vision_pb2.py and its types are generated from it
protobuf.py            build, encode and decode a message strictly: a stranger's bytes are checked before use
"""
