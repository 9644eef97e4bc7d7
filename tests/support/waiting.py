"""Wait for something that a page does."""

import time


def until(page, condition):
    """Wait until an expression of the page is true.

    ``wait_for_function`` makes its code from text within the page, which the policy of our pages forbids.
    """
    end = time.monotonic() + 60.0
    while not page.evaluate(condition):
        assert time.monotonic() < end, condition
        page.wait_for_timeout(20)
