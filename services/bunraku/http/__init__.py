"""Authentication, authorization, CORS, limits, problem documents and the access log."""
