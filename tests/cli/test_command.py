"""The command from outside: exit codes (docs/exit-codes.md), messages, and what happens to files.

Run by ctest; HEXOPT_GPU names the executable.
"""
import os
import subprocess
import unittest

COMMAND = os.environ["HEXOPT_GPU"]
OK, USAGE = 0, 2


def run(*arguments, **keywords):
    return subprocess.run([COMMAND, *map(str, arguments)], capture_output=True, text=True, timeout=120, **keywords)


class Usage(unittest.TestCase):
    def assert_usage_error(self, result):
        self.assertEqual(result.returncode, USAGE, result.stderr)
        self.assertEqual(result.stdout, "")
        self.assertTrue(result.stderr.startswith("error: "), result.stderr)

    def test_no_arguments(self):
        self.assert_usage_error(run())

    def test_unknown_command(self):
        result = run("optimise")
        self.assert_usage_error(result)
        self.assertIn("optimise", result.stderr)

    def test_unknown_option(self):
        result = run("--frobnicate")
        self.assert_usage_error(result)
        self.assertIn("--frobnicate", result.stderr)

    def test_help_and_version(self):
        for option in ("--help", "--version"):
            result = run(option)
            self.assertEqual(result.returncode, OK)
            self.assertIn("hexopt-gpu", result.stdout)
            self.assertEqual(result.stderr, "")

    def test_full_standard_output_is_reported(self):
        with open("/dev/full", "w") as full:
            result = subprocess.run([COMMAND, "--version"], stdout=full, stderr=subprocess.PIPE, text=True)
        self.assertEqual(result.returncode, 4)


if __name__ == "__main__":
    unittest.main()
