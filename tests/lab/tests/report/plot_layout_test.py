#!/usr/bin/python3
"""Spans of axes and places of names in plots: plot_layout_test.py FOLDER_OF_PLOT_PY"""
import math
import random
import sys
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, sys.argv.pop(1))
import plot


def axis(logarithmic):
    return {"logarithmic": logarithmic, "low": None, "high": None}


class Span(unittest.TestCase):
    def test_holds_all_that_can_be_shown(self):
        for seed in range(300):
            draw, logarithmic = random.Random(seed), seed % 2 == 1
            values = [draw.uniform(-5.0, 5.0) for _ in range(1 + seed % 7)]
            if logarithmic:
                values = [10.0 ** value for value in values]
            low, high = plot.span_of(axis(logarithmic), values)
            self.assertTrue(low <= min(values) and max(values) <= high, f"seed {seed}")

    def test_of_nothing_or_of_one_value_is_not_empty(self):
        for logarithmic in (False, True):
            for values in ([], [0.0], [3.0], [None]):
                low, high = plot.span_of(axis(logarithmic), values)
                self.assertGreater(high, low)
                self.assertTrue(low > 0.0 or not logarithmic)

    def test_shows_zero_where_it_is_near(self):
        self.assertEqual(plot.span_of(axis(False), [0.11, 0.25])[0], 0.0)
        self.assertGreater(plot.span_of(axis(False), [100.0, 101.0])[0], 90.0)

    def test_has_numbers_however_long_it_is(self):
        for low, decades in ((1.1e-9, 18), (0.3, 2), (1.1, 0.1)):
            ticks = plot.log_ticks(low, low * 10.0 ** decades)
            self.assertTrue(2 <= len(ticks) <= 10, f"{len(ticks)} numbers in {decades} decades")


class Labels(unittest.TestCase):
    def test_cover_no_mark_and_no_other_label(self):
        wide = 40.0
        for seed in range(100):
            draw = random.Random(seed)
            tags = [(draw.uniform(50, 450), draw.uniform(50, 350), "a name" if n % 2 else "") for n in range(30)]
            placed = plot.placed_labels(tags, lambda _: wide, 40, 460, 40, 360)
            self.assertTrue(placed)
            for n, (_, x, y) in enumerate(placed):
                for mark_x, mark_y, _ in tags:
                    self.assertFalse(x < mark_x < x + wide and y < mark_y < y + plot.FONT, f"seed {seed}")
                for _, other_x, other_y in placed[:n]:
                    self.assertTrue(abs(x - other_x) >= wide or abs(y - other_y) >= plot.FONT, f"seed {seed}")

    def test_are_left_out_rather_than_crowded(self):
        placed = plot.placed_labels([(100, 100, "the same place")] * 40, lambda _: 90.0, 0, 300, 0, 300)
        self.assertTrue(1 <= len(placed) <= 8)


if __name__ == "__main__":
    unittest.main()
