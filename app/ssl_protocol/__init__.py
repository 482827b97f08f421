"""Messages of other people's protocols: what stands in them, as frozen records, and their bytes.

    protobuf.py       a record's fields say their numbers and kinds; encode and decode walk them
    messages.py       the Small Size League's geometry and detections

Written by hand rather than with Google's package: a dozen small messages need neither a compiler nor a dependency, and
a stranger's datagram is read under limits of our own. The tests hold both against Google's implementation.
"""
