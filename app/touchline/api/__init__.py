"""The REST and WebSocket API: routes by resource, each a few lines that call services and workflows.

    routes/             resources, those that belong together in one file
    schemas/            requests.py: strict, bounded bodies and parameters; responses.py: answers of several resources
    description/        the OpenAPI document: meanings with units, examples
    dependencies.py     what routes receive: services, a version, the operator's name, If-Match; @in_thread
    responses.py        JSON without NaN, pages, ETags, jobs, pictures; @cached_response
    revalidation.py     304 for who has the answer already
    sockets.py          WebSocket sessions: sending, receiving, refusing
    bodies.py           bodies of more than one kind: JSON or a file, JSON or binary points
    request_mapping.py  from a fit's body to the task of the workflows
    middleware/         access, limits, security headers, problems, the page's files
    server.py           the socket, the token and uvicorn

To add a resource: a file in routes/ with a `router`, its bodies and its answers, named in touchline/capabilities.py.
Work of a second or two is a plain function, marked @in_thread; @cached_response stands before that where the answer
rests on versions alone.
"""
