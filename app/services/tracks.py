"""Tracks of a rig: one fusion of its cameras' detections, shared by all who watch."""

from app.live.track_fusion import TrackFusion
from app.services.container import Services


async def track_fusion_of(services: Services, rig: str) -> TrackFusion:
    """Return the rig's fusion, a new one where its cameras have changed; NotFound."""
    saved = await services.run_in_thread(services.store.rigs.get, rig)
    cameras = tuple(camera["camera"] for camera in saved.body["cameras"])
    fusion = services.track_fusions.get(rig)
    if fusion is None or fusion.names != cameras:
        if fusion is not None:
            fusion.end()
        fusion = services.track_fusions[rig] = TrackFusion(cameras, services.live.get)
    return fusion
