"""Plans the manoeuvre that would tell effects apart, or show one at all."""
