"""The OpenAPI document: what the framework knows of the routes, completed by meanings, units and examples.

document.py    puts it together
fields.py      fields whose name means the same everywhere; own_fields.py: those of single components
parameters.py  parameters of paths, queries and headers
examples.py    an example for each body
"""
