"""Referee messages as a game controller sends them, from the league's own definitions and not from the program's.

The fields and their numbers are those of RoboCup-SSL/ssl-game-controller, proto/state/ssl_gc_referee_message.proto.
"""

import time

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

F = descriptor_pb2.FieldDescriptorProto
UINT32, UINT64, SINT64, BOOL, TEXT = (
    F.TYPE_UINT32,
    F.TYPE_UINT64,
    F.TYPE_SINT64,
    F.TYPE_BOOL,
    F.TYPE_STRING,
)
REQUIRED, OPTIONAL, REPEATED = F.LABEL_REQUIRED, F.LABEL_OPTIONAL, F.LABEL_REPEATED
TEAM = (
    ("name", 1, TEXT, REQUIRED),
    ("score", 2, UINT32, REQUIRED),
    ("red_cards", 3, UINT32, REQUIRED),
    ("yellow_card_times", 4, UINT32, REPEATED),
    ("yellow_cards", 5, UINT32, REQUIRED),
    ("timeouts", 6, UINT32, REQUIRED),
    ("timeout_time", 7, UINT32, REQUIRED),
    ("goalkeeper", 8, UINT32, REQUIRED),
    ("foul_counter", 9, UINT32, OPTIONAL),
)
REFEREE = (
    ("packet_timestamp", 1, UINT64, REQUIRED),
    ("stage", 2, "Stage", REQUIRED),
    ("stage_time_left", 3, SINT64, OPTIONAL),
    ("command", 4, "Command", REQUIRED),
    ("command_counter", 5, UINT32, REQUIRED),
    ("command_timestamp", 6, UINT64, REQUIRED),
    ("yellow", 7, "TeamInfo", REQUIRED),
    ("blue", 8, "TeamInfo", REQUIRED),
    ("blue_team_on_positive_half", 10, BOOL, OPTIONAL),
    ("source_identifier", 18, TEXT, OPTIONAL),
    ("match_type", 19, UINT32, OPTIONAL),
    ("status_message", 20, TEXT, OPTIONAL),
)
ENUMS = {
    "Stage": {"NORMAL_FIRST_HALF_PRE": 0, "NORMAL_FIRST_HALF": 1, "POST_GAME": 13, "LATER": 40},
    "Command": {"HALT": 0, "STOP": 1, "FORCE_START": 3, "BALL_PLACEMENT_BLUE": 17, "NEWER": 99},
}


def _classes():
    file = descriptor_pb2.FileDescriptorProto(
        name="tests/referee.proto", syntax="proto2", package="tests_of_the_league"
    )
    for name, values in ENUMS.items():
        enum = file.enum_type.add(name=name)
        for word, value in values.items():
            enum.value.add(name=word, number=value)
    for name, fields in (("TeamInfo", TEAM), ("Referee", REFEREE)):
        message = file.message_type.add(name=name)
        for field, number, kind, label in fields:
            one = message.field.add(name=field, number=number, label=label)
            if isinstance(kind, str):
                one.type = F.TYPE_ENUM if kind in ENUMS else F.TYPE_MESSAGE
                one.type_name = f".{file.package}.{kind}"
            else:
                one.type = kind
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return (
        message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{file.package}.{name}"))
        for name in ("TeamInfo", "Referee")
    )


TeamInfo, Referee = _classes()


def team(name):
    """A team as it is before a match."""
    return TeamInfo(
        name=name, score=0, red_cards=0, yellow_cards=0, timeouts=4, timeout_time=1, goalkeeper=0
    )


def referee(blue="ibis", yellow="TIGERs Mannheim", **changes) -> bytes:
    """One packet; changes: of the message's fields."""
    now_us = int(time.time() * 1e6)
    fields = {
        "packet_timestamp": now_us,
        "stage": ENUMS["Stage"]["NORMAL_FIRST_HALF"],
        "command": ENUMS["Command"]["FORCE_START"],
        "command_counter": 7,
        "command_timestamp": now_us,
        "stage_time_left": -5,
        "status_message": "Goal!",
        "source_identifier": "the-one",
    }
    return Referee(
        yellow=team(yellow), blue=team(blue), **{**fields, **changes}
    ).SerializeToString()
