"""HTTP concerns of all services: authentication, authorization, CORS, limits, problem documents, access log."""
