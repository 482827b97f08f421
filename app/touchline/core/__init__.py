"""What every other package builds on: errors, geometry, the records that flow, fields, options."""
