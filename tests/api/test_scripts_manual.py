"""The scripts that the manual shows: at a server and inside their own process, as they stand there."""

import csv
import re
import subprocess
import sys

import numpy as np
import pytest

from tests.support.folder_pictures import clicks, picture
from tests.support.paths import HELP
from tests.support.servers import served

TEXT = (HELP / "scripts.md").read_text()


def script(name: str) -> str:
    (found,) = re.findall(rf"```python run {name}\n(.*?)```", TEXT, re.DOTALL)
    return found


def run(text: str, folder) -> str:
    done = subprocess.run([sys.executable, "-c", text], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("place", ["server", "process"])
def test_the_story_of_the_client_does_what_it_says(tmp_path, place):
    text, server = script("story"), 'Client("http://127.0.0.1:8000")'
    assert server in text and len(text.splitlines()) <= 30
    picture(tmp_path / "field.png")
    if place == "process":
        said = run(text.replace(server, "Client.temporary()"), tmp_path)
    else:
        with served(tmp_path / "data") as url:
            said = run(text.replace("http://127.0.0.1:8000", url), tmp_path)
    assert "%" in said and "[[" in said and "mm" in said
    assert (tmp_path / "corrected.png").stat().st_size > 1000
    assert np.load(tmp_path / "north.npz").files


def test_a_folder_of_images_becomes_a_table_that_goes_on_where_it_ended(tmp_path):
    text = script("recipe")
    assert len(text.splitlines()) <= 40
    folder = tmp_path / "pictures"
    folder.mkdir()
    for number in (1, 2):
        picture(folder / f"north-{number}.png", number)
    clicks(folder / "north-1.json")
    (folder / "broken.png").write_bytes(b"\x89PNG no more")
    run(text, tmp_path)
    table = tmp_path / "table.csv"
    rows = {row["image"]: row for row in csv.DictReader(table.open())}
    assert {*rows} == {"broken.png", "north-1.png", "north-2.png"}
    assert rows["broken.png"]["verdict"] == "failed" and rows["broken.png"]["fix"]
    assert float(rows["north-1.png"]["expected_mm"]) < 20 and rows["north-2.png"]["verdict"] in (
        "good",
        "fair",
        "poor",
    )
    before = table.read_text()
    kept = "\n".join(line for line in before.splitlines() if not line.startswith("north-2")) + "\n"
    table.write_text(kept)
    run(text, tmp_path)
    after = table.read_text()
    assert after.startswith(kept) and after.count("north-2.png") == 1
    assert len(after.splitlines()) == len(before.splitlines())
