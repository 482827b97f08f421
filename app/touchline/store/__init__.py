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
    opening.py     check, restore the newest good backup, or refuse; migrations/ bring tables to their newest form
    database.py    one writer and many readers, on SQLite or PostgreSQL; tables.py: the rows
    repository.py  what the repositories share: snapshots, drafts, calibrations, lenses, and those of capabilities;
                   documents.py: named JSON, such as cameras, rigs and presets; jobs.py has a table of its own kind
    integrity.py   checksums of rows; what is damaged, cannot be read, or is missing
    backups.py     copies of the database
    archive.py     everything as one zip, and back into an empty folder
    files.py       atomic files, how much of the disk they may take, and what could not be read or saved lately
    quarantine.py  what is damaged, and the databases that a backup has replaced
    lock.py        one server a folder

Fields are YAML files, written by people too: fields.py. It, files.py and quarantine.py need no database: processes
that only compute import them alone.
"""
