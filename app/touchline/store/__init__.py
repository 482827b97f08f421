"""What is stored: snapshots, drafts, calibrations, cameras, rigs, jobs, … in a database; pictures as files beside it.

What a Store returns is a contract; that it is SQLite or PostgreSQL is not. Every row and every picture carries its
checksum and is checked whenever it is read; a damaged one is put into quarantine/ and named in `damaged`. What a call
has saved survives a killed process and a power cut. One process at a time opens a data folder.

    with Store(folder) as store:
        snapshot = store.snapshots.add(data, frame.size, declared.format, camera="north")
        draft = store.drafts.save(snapshot.id, body, etag=store.drafts.get(snapshot.id).etag)
        calibration = store.calibrations.add(calibration)
        store.calibrations.activate(calibration.id)

    store.py       the Store, one folder with all of it
    opening.py     check, restore or refuse; schema.py and migrations/ bring the tables to their newest form
    database.py    one writer and many readers, on SQLite or PostgreSQL; tables.py: the rows, checksummed.py: checksums
    repository.py  what the repositories share: snapshots, drafts, calibrations, lenses, and those of capabilities;
                   documents.py: named JSON, such as cameras, rigs and presets; jobs.py has a table of its own kind
    integrity.py   what is damaged, cannot be read, or is missing; row_counts.py: how many rows there should be
    backups.py     copies of the database; backup_restore.py puts the newest good one in its place, and replaced.py
                   keeps the three newest that it replaced
    passwords.py   the key of cameras' passwords; failures.py: what could not be read or saved lately
    cache.py       what was used lately, such as parsed versions
    quota.py       how much of the disk pictures may take; disk_usage.py measures how much everything takes
    archive.py     everything as one zip, and back; restore.py fills an empty folder with it
    files.py, quarantine.py, lock.py    atomic files, what is damaged, one server a folder

Fields are YAML files, written by people too: fields.py. It, files.py and quarantine.py need no database: processes
that only compute import them alone.
"""
