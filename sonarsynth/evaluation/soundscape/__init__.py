"""What hydrophones hear of a sea: its figures measured, beside those that its models predict."""
