"""Industrial cameras: GenICam producers and Aravis."""
