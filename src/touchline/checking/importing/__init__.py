"""Foreign logs made into sessions of ours."""
