"""The command line imports the module of the command that is asked for, and no other."""

import json
import subprocess
import sys

import pytest
import typer

from tests.support.paths import ROOT
from touchline import capabilities
from touchline.core.registry import load

# Runs the command line with the words given, and prints which packages were imported.
PROBE = (
    "import atexit, json, sys\n"
    "atexit.register(lambda: print('\\n' + json.dumps(sorted(sys.modules))))\n"
    "from touchline.cli import main\n"
    "main()\n"
)


def imported_by(*words):
    done = subprocess.run(
        [sys.executable, "-c", PROBE, *words], cwd=ROOT, capture_output=True, text=True, timeout=300
    )
    return set(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.parametrize("word", ["--help", "--version"])
def test_help_and_version_import_no_command(word):
    loaded = imported_by(word)
    assert not {"cv2", "numpy", "fastapi", "sqlalchemy", "google.protobuf"} & loaded
    assert not {target.partition(":")[0] for target, _ in capabilities.commands().values()} & loaded


def test_a_command_for_files_imports_no_server_and_no_other_command():
    loaded = imported_by("transform", "--help")
    assert "touchline.cli.calibration" in loaded
    assert not {"fastapi", "uvicorn", "viser", "touchline.automatic.commands"} & loaded


def test_a_process_that_only_computes_imports_no_database():
    """Each camera and each job has one: it starts with them, and keeps what it has imported."""
    modules = (
        "touchline.live.worker_main",
        "touchline.images.decoder_worker",
        "touchline.jobs.worker_main",
        *(target.partition(":")[0] for target in capabilities.jobs().values()),
    )
    code = f"import sys\nfrom importlib import import_module\nfor m in {modules}: import_module(m)\nprint(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    ).stdout.split()
    assert "numpy" in loaded and not {"sqlalchemy", "alembic", "fastapi", "uvicorn"} & set(loaded)


@pytest.mark.parametrize("name", capabilities.commands())
def test_the_line_in_the_list_of_commands_begins_the_command_s_own_help(name):
    target, line = capabilities.commands()[name]
    command = load(target)
    text = command.info.help if isinstance(command, typer.Typer) else command.__doc__
    assert text.partition("\n")[0] == line
