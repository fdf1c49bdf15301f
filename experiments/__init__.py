"""One runnable module per figure or table."""
