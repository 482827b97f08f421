"""The REST and WebSocket API: routes by resource, each a few lines that call services and workflows.

    routes/          resources, those that belong together in one file
    requests.py      strict, bounded bodies and parameters
    schemas.py       how answers are described, and answers of several resources
    description/     the OpenAPI document: meanings with units, examples
    dependencies.py  what routes receive: services, a version, the operator's name, If-Match; @in_thread
    responses.py     JSON without NaN, pages, ETags, 304, jobs, pictures; @cached_response
    sockets.py       WebSocket sessions: sending, receiving, refusing
    bodies.py        bodies of more than one kind: JSON or a file, JSON or binary points; a fit's body as a task
    middleware/      access, limits, security headers, problems, the page's files
    server.py        the socket, the token and uvicorn

To add a resource: a file in routes/ with a `router`, its bodies and its answers, named in touchline/capabilities.py.
Work of a second or two is a plain function, marked @in_thread; @cached_response stands before that where the answer
rests on versions alone.
"""
