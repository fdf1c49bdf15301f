"""Viewer of a run in the web browser, by viser."""

from seals.plugins.viewers.browser.viewer import ViewerBrowser as ViewerBrowser
