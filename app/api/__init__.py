"""The REST door: routes by resource, each a few lines that call the floors below and hold no arithmetic.

    problems.py   every refusal, as problem+json with `fix`
    schemas.py    what a request may look like: strict, nothing unknown, nothing infinite
    answers.py    what an answer looks like: plain JSON, null for NaN, pictures
    access.py     who may come in: the token, its cookie, where a request comes from
    limits.py     how much may come in at once
    work.py       where long arithmetic runs, so that short answers stay short
    operator.py   who asks, as far as it is told
    health, archive, fields, models, fit, snapshots, drafts, calibrations, boards, lenses, pairs, jobs, cameras,
                  publishing: the resources
"""
