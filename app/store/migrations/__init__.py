"""How the tables came to be what they are: one file a step, run in order by schema.py when the store is opened.

A step that was once released is never changed. tests/test_store_schema.py holds the last one against tables.py.
"""
