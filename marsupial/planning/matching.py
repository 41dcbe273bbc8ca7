"""The assignment problem (least total cost), by shortest augmenting paths.

The same algorithm as scipy's `linear_sum_assignment`, ties included. Importing that takes longer than a small mission,
and teams have few robots.

References
----------
D. F. Crouse, "On implementing 2D rectangular assignment algorithms", IEEE Transactions on Aerospace and Electronic
Systems 52(4), 2016, section III.
"""

import numpy as np

from marsupial.arrays import Floats, Ints


def least_assignment(costs: Floats) -> tuple[Ints, Ints]:
    """Return the rows, ascending, and their columns: as many pairs as possible, with the least sum of finite costs."""
    rows, columns = costs.shape
    if rows <= columns:
        return np.arange(rows), _columns(costs)
    assigned = _columns(costs.T)
    order = np.argsort(assigned)
    return assigned[order], order


def _columns(costs: Floats) -> Ints:
    rows, columns = costs.shape
    row_price, column_price = np.zeros(rows), np.zeros(columns)
    column_of, row_of = np.full(rows, -1), np.full(columns, -1)
    for start in range(rows):
        via, length = np.full(columns, -1), np.full(columns, np.inf)
        left = np.arange(columns)[::-1].copy()  # this order breaks ties between columns
        row, least = start, 0.0
        passed_rows, passed_columns = [], []
        while row >= 0:
            passed_rows.append(row)
            longer = least + costs[row, left] - row_price[row] - column_price[left]
            shorter = longer < length[left]
            length[left[shorter]], via[left[shorter]] = longer[shorter], row
            least = length[left].min()
            nearest = np.flatnonzero(length[left] == least)
            free = nearest[row_of[left[nearest]] < 0]
            index = free[-1] if len(free) else nearest[0]
            column = left[index]
            left[index] = left[-1]
            left = left[:-1]
            passed_columns.append(column)
            row = row_of[column]
        row_price[start] += least
        others = passed_rows[1:]
        row_price[others] += least - length[column_of[others]]
        column_price[passed_columns] -= least - length[passed_columns]
        while row != start:
            row = via[column]
            row_of[column] = row
            column_of[row], column = column, column_of[row]
    return column_of
