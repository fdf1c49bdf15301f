"""A basket of 0.4 m that stands on the sea bed or on a stand."""
