from google.protobuf.internal import enum_type_wrapper as _enum_type_wrapper
from google.protobuf import descriptor as _descriptor
from google.protobuf import message as _message
from typing import ClassVar as _ClassVar, Mapping as _Mapping, Optional as _Optional, Union as _Union

BALL_PLACEMENT_BLUE: RefereeCommand
BALL_PLACEMENT_YELLOW: RefereeCommand
DESCRIPTOR: _descriptor.FileDescriptor
DIRECT_FREE_BLUE: RefereeCommand
DIRECT_FREE_YELLOW: RefereeCommand
EXTRA_FIRST_HALF: RefereeStage
EXTRA_FIRST_HALF_PRE: RefereeStage
EXTRA_HALF_TIME: RefereeStage
EXTRA_SECOND_HALF: RefereeStage
EXTRA_SECOND_HALF_PRE: RefereeStage
EXTRA_TIME_BREAK: RefereeStage
FORCE_START: RefereeCommand
GOAL_BLUE: RefereeCommand
GOAL_YELLOW: RefereeCommand
HALT: RefereeCommand
INDIRECT_FREE_BLUE: RefereeCommand
INDIRECT_FREE_YELLOW: RefereeCommand
NORMAL_FIRST_HALF: RefereeStage
NORMAL_FIRST_HALF_PRE: RefereeStage
NORMAL_HALF_TIME: RefereeStage
NORMAL_SECOND_HALF: RefereeStage
NORMAL_SECOND_HALF_PRE: RefereeStage
NORMAL_START: RefereeCommand
PENALTY_SHOOTOUT: RefereeStage
PENALTY_SHOOTOUT_BREAK: RefereeStage
POST_GAME: RefereeStage
PREPARE_KICKOFF_BLUE: RefereeCommand
PREPARE_KICKOFF_YELLOW: RefereeCommand
PREPARE_PENALTY_BLUE: RefereeCommand
PREPARE_PENALTY_YELLOW: RefereeCommand
STOP: RefereeCommand
TIMEOUT_BLUE: RefereeCommand
TIMEOUT_YELLOW: RefereeCommand

class RefereePacket(_message.Message):
    __slots__ = ["blue", "blue_team_on_positive_half", "command", "packet_timestamp", "source_identifier", "stage", "yellow"]
    BLUE_FIELD_NUMBER: _ClassVar[int]
    BLUE_TEAM_ON_POSITIVE_HALF_FIELD_NUMBER: _ClassVar[int]
    COMMAND_FIELD_NUMBER: _ClassVar[int]
    PACKET_TIMESTAMP_FIELD_NUMBER: _ClassVar[int]
    SOURCE_IDENTIFIER_FIELD_NUMBER: _ClassVar[int]
    STAGE_FIELD_NUMBER: _ClassVar[int]
    YELLOW_FIELD_NUMBER: _ClassVar[int]
    blue: RefereeTeam
    blue_team_on_positive_half: bool
    command: int
    packet_timestamp: int
    source_identifier: str
    stage: int
    yellow: RefereeTeam
    def __init__(self, packet_timestamp: _Optional[int] = ..., stage: _Optional[int] = ..., command: _Optional[int] = ..., yellow: _Optional[_Union[RefereeTeam, _Mapping]] = ..., blue: _Optional[_Union[RefereeTeam, _Mapping]] = ..., blue_team_on_positive_half: bool = ..., source_identifier: _Optional[str] = ...) -> None: ...

class RefereeTeam(_message.Message):
    __slots__ = ["name"]
    NAME_FIELD_NUMBER: _ClassVar[int]
    name: str
    def __init__(self, name: _Optional[str] = ...) -> None: ...

class RefereeStage(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []

class RefereeCommand(int, metaclass=_enum_type_wrapper.EnumTypeWrapper):
    __slots__ = []
