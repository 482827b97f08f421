"""How the tables came to be what they are: one file a step, run in order by opening.py when the store is opened.

A step that was once released is never changed. tests/unit/store/test_store_opening.py compares the last one with
tables.py.
"""
