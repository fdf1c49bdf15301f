"""Meshes of the sea spider, written by make_sea_spider.py."""
