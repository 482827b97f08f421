"""What every request passes: connections, limits, access, headers, problems, the page's files."""
