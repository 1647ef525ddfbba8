#!/usr/bin/env python3
"""Shows that the unit-test runner in this folder fails when it must: every kind of assertion, crashes, empty suites.

Translates, compiles and runs small suites in the current folder and reads what they report.
"""
import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

HERE = Path(__file__).resolve().parent
FC = os.environ.get("UNILAT_FC", "gfortran")
FLAGS = ["-O0", "-g", "-fcheck=all,no-array-temps", "-ffpe-trap=invalid,zero,overflow", "-std=f2008",
         "-ffree-line-length-none"]

# One assertion a row: what is asserted, and what the report must say; None when the assertion holds.
ASSERTIONS = [
    ("@assertEqual(1.0_wp, 1.0_wp)", None),
    ("@assertEqual(1.0_wp, 1.0_wp + 1e-9_wp, tolerance=1e-8_wp)", None),
    ("@assertEqual(1.0_wp, 1.5_wp)", "expected 1.0000000000000000 but got 1.5000000000000000"),
    ("@assertEqual(1.0_wp, 1.5_wp, tolerance=0.4_wp, message='load (N)')", "load (N): expected 1.0"),
    ("@assertEqual(1.0_wp, nan(), tolerance=1e9_wp)", "but got NaN"),
    ("@assertEqual(nan(), nan())", "expected NaN but got NaN"),
    ("@assertEqual(1.0_wp, 1.0_wp, tolerance=nan())", "tolerance NaN"),
    ("@assertEqual(infinity(), infinity())", None),
    ("@assertEqual(-infinity(), infinity(), tolerance=infinity())", "but got Inf"),
    ("@assertEqual(1.0_wp, infinity(), tolerance=infinity())", "but got Inf"),
    ("@assertEqual([1.0_wp, 2.0_wp], [1.0_wp, 2.0_wp])", None),
    ("@assertEqual([1.0_wp, 2.0_wp], [1.0_wp, 2.5_wp], tolerance=0.1_wp)", "got 2.5000000000000000 at element (2)"),
    ("@assertEqual([1.0_wp, 2.0_wp], [1.0_wp, 2.0_wp, 3.0_wp])", "expected shape (2) but got (3)"),
    ("@assertEqual([1.0_wp, 2.0_wp], [1.0_wp, nan()], tolerance=1.0_wp)", "NaN at element (2)"),
    ("@assertEqual(0.0_wp, [0.0_wp, 0.0_wp])", None),
    ("@assertEqual(0.0_wp, [0.0_wp, 1.0_wp], tolerance=0.5_wp)", "at element (2)"),
    ("@assertEqual(0.0_wp, no_reals)", None),
    ("@assertEqual(square, square)", None),
    ("@assertEqual(square, 2 * square, tolerance=2.5_wp)", "expected 3.0000000000000000 but got 6.0000000000000000 at element (1,2)"),
    ("@assertEqual(square, reshape(square, [1, 4]))", "expected shape (2,2) but got (1,4)"),
    ("@assertEqual(0.0_wp, square, tolerance=1.5_wp)", "at element (2,1)"),
    ("@assertEqual(3, 3)", None),
    ("@assertEqual(3, 4, message='count')", "count: expected 3 but got 4"),
    ("@assertEqual(3_int64, 4_int64)", "expected 3 but got 4"),
    ("@assertEqual(3, 4_int64)", "expected 3 but got 4"),
    ("@assertEqual([1, 2], [1, 2])", None),
    ("@assertEqual([1, 2], [1, 3])", "expected 2 but got 3 at element (2)"),
    ("@assertEqual([1, 2], [1])", "expected shape (2) but got (1)"),
    ("@assertEqual(1, [1, 2])", "at element (2)"),
    ("@assertEqual(reshape([1, 2, 3, 4], [2, 2]), reshape([1, 2, 3, 5], [2, 2]))", "at element (2,2)"),
    ("@assertEqual(1, reshape([1, 2, 3, 4], [2, 2]))", "at element (2,1)"),
    ("@assertEqual('ring', 'ring  ')", None),
    ("@assertEqual('ring', 'rings')", 'expected "ring" but got "rings"'),
    ("@assertEqual('', 'a')", 'expected "" but got "a"'),
    ("@assertEqual('', '  ')", None),
    ("@assertEqual(.true., .false.)", "expected T but got F"),
    ("@assertEqual([.true., .false.], [.true., .true.])", "expected F but got T at element (2)"),
    ("@assertRelativelyEqual(100.0_wp, 101.0_wp, tolerance=0.02_wp)", None),
    ("@assertRelativelyEqual(100.0_wp, 103.0_wp, tolerance=0.02_wp)", "relative tolerance"),
    ("@assertRelativelyEqual(100.0_wp, nan(), tolerance=0.02_wp)", "NaN"),
    ("@assertRelativelyEqual(0.0_wp, 0.0_wp, tolerance=0.02_wp)", "a relative comparison with zero"),
    ("@assertRelativelyEqual([1.0_wp, 2.0_wp], [1.0_wp, 2.1_wp], tolerance=0.01_wp)", "at element (2)"),
    ("@assertRelativelyEqual(1.0_wp, [1.0_wp, 2.0_wp], tolerance=0.01_wp)", "at element (2)"),
    ("@assertRelativelyEqual(square, 1.5_wp * square, tolerance=0.01_wp)", "at element (1,1)"),
    ("@assertRelativelyEqual(1.0_wp, square, tolerance=0.01_wp)", "at element (2,1)"),
    ("@assertTrue(1 < 2)", None),
    ("@assertTrue(1 > 2, message='order')", "order: expected true but got false"),
    ("@assertTrue([.true., .false.])", "at element (2)"),
    ("@assertFalse(1 > 2)", None),
    ("@assertFalse(1 < 2)", "expected false but got true"),
    ("@assertFalse([.true., .false.])", "at element (1)"),
    ("@assertLessThan(1.0_wp, 2.0_wp)", None),
    ("@assertLessThan(2.0_wp, 2.0_wp)", "expected 2.0000000000000000 < 2.0000000000000000"),
    ("@assertLessThan(nan(), 2.0_wp)", "NaN < 2.0"),
    ("@assertLessThan(1.0_wp, [2.0_wp, 0.0_wp])", "at element (2)"),
    ("@assertLessThan([1.0_wp, 1.0_wp], [2.0_wp, 0.0_wp])", "at element (2)"),
    ("@assertLessThan([1.0_wp, 1.0_wp], [2.0_wp])", "expected shape (2) but got (1)"),
    ("@assertLessThan(2, 1)", "expected 2 < 1"),
    ("@assertLessThanOrEqual(2.0_wp, 2.0_wp)", None),
    ("@assertLessThanOrEqual(2.0_wp, 1.0_wp)", "<= 1.0"),
    ("@assertLessThanOrEqual(2, 1)", "expected 2 <= 1"),
    ("@assertGreaterThan(2.0_wp, 1.0_wp)", None),
    ("@assertGreaterThan(2.0_wp, 2.0_wp)", "> 2.0"),
    ("@assertGreaterThan(nan(), 2.0_wp)", "NaN > 2.0"),
    ("@assertGreaterThan(1, 1)", "expected 1 > 1"),
    ("@assertGreaterThanOrEqual(2.0_wp, 2.0_wp)", None),
    ("@assertGreaterThanOrEqual(1.0_wp, 2.0_wp)", ">= 2.0"),
    ("@assertGreaterThanOrEqual(1, 2)", "expected 1 >= 2"),
    ("@assertIsFinite(1.0_wp)", None),
    ("@assertIsFinite(nan())", "expected a finite number but got NaN"),
    ("@assertIsFinite(infinity())", "but got Inf"),
]

HEAD = """module {name}
   use, intrinsic :: iso_fortran_env, only: wp => real64, int64
   use, intrinsic :: ieee_arithmetic, only: ieee_value, ieee_quiet_nan, ieee_positive_inf
   use funit
   implicit none
   real(wp), parameter :: square(2, 2) = reshape([1.0_wp, 2.0_wp, 3.0_wp, 4.0_wp], [2, 2])
   real(wp) :: no_reals(0)
   integer :: counter = 0
contains
   real(wp) function nan()
      nan = ieee_value(1.0_wp, ieee_quiet_nan)
   end function nan
   real(wp) function infinity()
      infinity = ieee_value(1.0_wp, ieee_positive_inf)
   end function infinity
"""


def call(*command):
    """Runs a command in the current folder; returns its status and all it printed."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace",
                          timeout=60)
    return done.returncode, done.stdout


def translate(name, body, head=HEAD):
    Path(f"{name}.pf").write_text(head.format(name=name) + body + f"end module {name}\n")
    return call(sys.executable, str(HERE / "pf2f90.py"), ".", f"{name}.pf")


def run(name, body):
    """Translates, compiles and runs a suite; returns its status and report."""
    status, text = translate(name, body)
    assert status == 0, text
    status, text = call(FC, *FLAGS, f"{name}.f90", *(f"{m}.o" for m in MODULES), "-o", name)
    assert status == 0, text
    return call(f"./{name}")


def test(name, *lines):
    return "\n".join(["   @test", f"   subroutine {name}()", *(f"      {line}" for line in lines),
                      f"   end subroutine {name}", ""])


MODULES = ["funit_report", "funit_compare", "funit"]


class Runner(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        for module in MODULES:
            status, text = call(FC, *FLAGS, "-c", str(HERE / f"{module}.f90"), "-o", f"{module}.o")
            assert status == 0, text

    def test_every_assertion_holds_or_fails_as_it_must(self):
        body = "".join(test(f"t{k}", assertion, "print '(a)', 'went on'") for k, (assertion, _) in enumerate(ASSERTIONS))
        status, text = run("test_assertions", body)
        self.assertEqual(status, 1, text)
        lines = Path("test_assertions.pf").read_text().splitlines()
        blocks = dict(re.findall(r"^   (t\d+) \.\.\. ((?:.*\n)*?)(?=   t\d+ \.\.\. |test_assertions:)", text, re.MULTILINE))
        for k, (assertion, words) in enumerate(ASSERTIONS):
            with self.subTest(assertion=assertion):
                report = blocks[f"t{k}"]
                if words is None:
                    self.assertEqual(report, "went on\nok\n")
                else:                               # failed, at this line, in these words, and returned at once
                    line = 1 + lines.index("   subroutine t%d()" % k) + 1
                    self.assertTrue(report.startswith(f"FAILED\n   test_assertions.pf:{line}: "), report)
                    self.assertIn(words, report)
                    self.assertNotIn("went on", report)
        failures = sum(words is not None for _, words in ASSERTIONS)
        self.assertIn(f"test_assertions: {len(ASSERTIONS) - failures} passed, {failures} failed, 0 disabled", text)

    def test_suite_that_passes(self):
        status, text = run("test_good", test("one", "@assertEqual(1, 1)") + test("two", "@assertTrue(.true.)"))
        self.assertEqual(status, 0, text)
        self.assertIn("test_good: 2 passed, 0 failed, 0 disabled", text)

    def test_one_failure_among_many_sets_the_status(self):
        status, text = run("test_mixed", test("bad", "@assertEqual(1, 2)") + test("good", "@assertTrue(.true.)"))
        self.assertEqual(status, 1, text)
        self.assertIn("test_mixed: 1 passed, 1 failed, 0 disabled", text)

    def test_before_and_after_run_around_every_test(self):
        around = """   @before
   subroutine set_up()
      counter = counter + 1
   end subroutine set_up
   @after
   subroutine tear_down()
      counter = counter + 10
   end subroutine tear_down
"""
        status, text = run("test_around", around + test("one", "@assertEqual(1, counter)", "@assertEqual(1, 2)")
                           + test("two", "@assertEqual(12, counter)"))
        self.assertIn("test_around: 1 passed, 1 failed, 0 disabled", text)
        self.assertEqual(status, 1)

    def test_failure_inside_a_helper_counts(self):
        helper = "   subroutine helper()\n      @assertEqual(1, 2)\n   end subroutine helper\n"
        status, text = run("test_helper", helper + test("one", "call helper()"))
        self.assertEqual(status, 1, text)
        self.assertIn("0 passed, 1 failed", text)

    def test_crash_stop_and_trap_are_failures(self):
        crashes = {"error_stop": ["error stop"], "stop": ["stop"], "stop0": ["stop 0"],
                   "zero": ["counter = 0", "print *, 1.0_wp / counter"],
                   "bounds": ["counter = 3", "print *, square(counter, 1)"],
                   "abort": ["call abort()"]}
        for name, lines in crashes.items():
            with self.subTest(name):
                body = test("good", "@assertTrue(.true.)") + test("crashes", *lines) + test("after", "counter = 0")
                if name == "abort":
                    body = body.replace("call abort()", "block\n      interface\n         subroutine c_abort() "
                                        "bind(c, name='abort')\n         end subroutine\n      end interface\n"
                                        "      call c_abort()\n      end block")
                status, text = run(f"test_{name}", body)
                self.assertNotEqual(status, 0, text)
                self.assertIn("crashes ... ", text)
                self.assertNotIn("after ...", text)
                if "stop" in name or name == "bounds":
                    self.assertIn("funit: the program was stopped before its end", text)

    def test_suite_with_all_tests_disabled_fails(self):
        status, text = run("test_disabled", test("one", "@assertTrue(.true.)").replace("@test", "@test\n   @disable"))
        self.assertEqual(status, 1, text)
        self.assertIn("no test ran", text)

    def test_disabled_test_is_reported_and_not_run(self):
        status, text = run("test_partly", test("off", "error stop").replace("@test", "@test\n   @disable") + test("on"))
        self.assertEqual(status, 0, text)
        self.assertIn("test_partly: 1 passed, 0 failed, 1 disabled", text)

    def test_compiler_messages_point_at_the_pf_file(self):
        status, text = translate("test_broken", test("one", "@assertTrue(.true.)", "counter = not_declared"))
        self.assertEqual(status, 0, text)
        status, text = call(FC, *FLAGS, "-c", "test_broken.f90")
        self.assertNotEqual(status, 0)
        number = 1 + Path("test_broken.pf").read_text().splitlines().index("      counter = not_declared")
        self.assertIn(f"test_broken.pf:{number}:", text)

    def test_what_the_translator_refuses(self):
        refused = {
            "no @test in it": "",
            "is not one of": test("one", "@assertThat(1, 2)"),
            "on one line": test("one", "@assertEqual(1, &", "   2)"),
            "no comment": test("one", "@assertTrue(.true.) ! (why)"),
            "on one line, without": test("one", "@assertTrue(.true.) ! why"),
            "not understood": "   @mpitest\n",
            "without arguments": "   @test\n   subroutine one(this)\n   end subroutine one\n",
            "@disable stands after @test": "   @disable\n" + test("one"),
            "stands twice": test("one") + test("one"),
            "at the end": test("one") + "   @before\n",
        }
        for words, body in refused.items():
            with self.subTest(words):
                if words == "at the end":
                    status, text = translate("test_refused", "", HEAD + test("one") + "   @before\n!")
                else:
                    status, text = translate("test_refused", body)
                self.assertEqual(status, 1)
                self.assertIn(words, text)
                self.assertIn("test_refused.pf", text)
        status, text = translate("test_refused", test("one"), HEAD.replace("module {name}", "module other"))
        self.assertEqual(status, 1)
        self.assertIn("test_refused.pf:1: module other must be called test_refused", text)


if __name__ == "__main__":
    unittest.main()
