from support.evidence import copied, finished, parts  # noqa: F401 - fixtures
