"""Tracks: one thing is one track, also where it was hidden for some frames."""

import numpy as np

from touchline.straight.tracks import MAX_MISSED, MovingBlob, Tracker


def test_what_was_hidden_for_some_frames_is_followed_on_at_its_own_speed():
    tracker, shown = Tracker(), [*range(8), *range(8 + MAX_MISSED - 1, 24)]
    ended = [
        track
        for frame in shown
        for track in tracker.add(frame, [MovingBlob(23.0 * frame, 240.0, 50.0, 40.0)])
    ]
    (track,) = [*ended, *tracker.end()]
    np.testing.assert_array_equal(track.frames, shown)
