"""What the documentation promises holds for any request it allows, and nothing that is sent breaks the server.

schemathesis makes requests from /api/v1/openapi.json; hypothesis adds what it does not: NaN, infinities, 1e999, half
surrogates, endless numbers, names and nestings, in any place of a good body.
"""

import copy
import json
import warnings

import pytest
import schemathesis
from hypothesis import HealthCheck, given, settings as effort, strategies as st
from refusals import API, without_size
from schemathesis import GenerationMode
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_schema_conformance,
    status_code_conformance,
)
