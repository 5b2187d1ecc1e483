"""A page that shows a run while it goes on, or its log: served to a browser on this machine.

``recording`` reads what is shown of a window of time from the log, ``film`` the pictures of the fluid,
``server`` answers the browser, ``assets`` is the page. What is drawn, and how, is the report's.
"""
