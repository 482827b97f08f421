"""Ball and robots in a picture and live: colours, stages, clips, tracks of several cameras."""
