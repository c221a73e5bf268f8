"""Looking at a run, while it goes on and afterwards: a page in the browser, and a recording for the Rerun viewer.

Both read the run's folder and nothing else, so that no process of a run knows of them or waits for them, and a run that
goes on is shown as one that is over. `reading.py` follows the folder's files, `server.py` serves the page in `page/`.
"""
