"""Rows of decimal numbers, from bytes to float64."""

from mvreg.geometry.arrays import Array

def parse_rows(data: bytes, start: int, rows: int, columns: int) -> tuple[Array, int] | None:
    """Parse a clean table: one row a line, blanks between the numbers, and nothing else.

    Parameters
    ----------
    data : bytes
    start : int
        Where in `data` the first row begins.
    rows, columns : int
        How many there are.

    Returns
    -------
    table : (rows, columns) array
        Bit for bit what `float` makes of the words.
    end : int
        Where in `data` the line after the last row begins, or the length of `data`.

    None instead where any of the lines is missing or blank, has another number of words, words that
    `float` does not take, or other white space than ASCII's: another reader may then say what is
    wrong.
    """
