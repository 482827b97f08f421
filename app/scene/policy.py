"""What viser's page may load: it unpacks itself, which takes inline scripts and WebAssembly; its decoders take eval.

Our own pages' policy stays as tight as it is (api/middleware).
"""

_PAGE = ("default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob:; style-src 'unsafe-inline'; "
         "img-src blob: data:; font-src data:; worker-src blob: data:; base-uri 'none'; form-action 'none'; "
         "connect-src blob: data:")
EXPORT_POLICY = _PAGE  # a saved file talks to nobody
PAGE_POLICY = f"{_PAGE} 'self'; frame-ancestors 'self'"  # behind our own port, to that port alone
