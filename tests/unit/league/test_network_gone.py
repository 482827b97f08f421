"""A network that goes and comes back, in a network namespace of its own: nothing of this machine is touched."""

import subprocess
import sys

import pytest

from tests.support.paths import ROOT
from tests.support.tiers import long

NAMESPACE = ["unshare", "--user", "--net", "--map-root-user"]
NO_TAP = 77


def allowed() -> bool:
    try:
        return subprocess.run([*NAMESPACE, "true"], capture_output=True).returncode == 0
    except OSError:
        return False


@pytest.mark.skipif(
    not allowed(),
    reason="this system lets nobody make a network namespace: a network that goes and "
    "comes back was not tried",
)
@pytest.mark.parametrize("interface", ["127.0.0.1", long("eth7")])
def test_a_network_that_goes_is_told_and_one_that_returns_is_used_again(interface):
    done = subprocess.run(
        [*NAMESPACE, sys.executable, "-m", "tests.support.network_story", interface],
        capture_output=True,
        text=True,
        timeout=200,
        cwd=ROOT,
    )
    if done.returncode == NO_TAP:
        pytest.skip(
            "this system lets nobody make a tap: an interface that is unplugged was not tried"
        )
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.split("\n")[-2] == "recovered"
