"""The command from outside: exit codes (docs/exit-codes.md), messages, and what happens to files.

Run by ctest; HEXOPT_GPU names the executable.
"""
import json
import os
import resource
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

COMMAND = os.environ["HEXOPT_GPU"]
SANITIZED = os.environ.get("HEXOPT_SANITIZE", "") != ""
OK, USAGE, BAD_INPUT, OUTPUT_FAILED, NO_VALID_MESH, DEVICE, MEMORY, CANCELLED, BELOW_TARGET = 0, 2, 3, 4, 5, 6, 7, 8, 9

# A unit cube whose bottom face is turned over: no vertex is free with a fixed boundary.
INVERTED_CUBE = """# vtk DataFile Version 3.0
inverted
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 8 double
1 0 0  0 0 0  0 1 0  1 1 0  0 0 1  1 0 1  1 1 1  0 1 1
CELLS 1 9
8 0 1 2 3 4 5 6 7
CELL_TYPES 1
12
"""


def run(*arguments, **keywords):
    return subprocess.run([COMMAND, *map(str, arguments)], capture_output=True, text=True, timeout=120, **keywords)


class Command(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def path(self, name):
        return self.folder / name

    def make(self, name="in.vtu", sample="grid", *options):
        result = run("sample", sample, "-o", self.path(name), "--quiet", *options)
        self.assertEqual(result.returncode, OK, result.stderr)
        return self.path(name)

    def assert_error(self, result, code, *words):
        self.assertEqual(result.returncode, code, result.stderr)
        errors = [line for line in result.stderr.splitlines() if line.startswith("error: ")]
        self.assertEqual(len(errors), 1, result.stderr)
        for word in words:
            self.assertIn(word, errors[0])


class Usage(Command):
    def test_no_arguments(self):
        self.assert_error(run(), USAGE)

    def test_unknown_command(self):
        self.assert_error(run("optimise"), USAGE, "optimise")

    def test_unknown_option(self):
        self.assert_error(run("--frobnicate"), USAGE, "--frobnicate")
        self.assert_error(run("optimize", "a.vtu", "b.vtu", "--frobnicate"), USAGE, "--frobnicate")

    def test_missing_argument(self):
        self.assert_error(run("optimize", "a.vtu"), USAGE, "OUT")

    def test_values_out_of_range(self):
        for option, value in (("--boundary", "sticky"), ("--max-deviation-rel", "0.5"), ("--min-sj", "2"),
                              ("--time", "-1"), ("--iterations", "0"), ("--threads", "-1"), ("--seed", "x"),
                              ("--feature-angle", "181")):
            with self.subTest(option=option):
                self.assert_error(run("optimize", "a.vtu", "b.vtu", option, value), USAGE, option)

    def test_choices(self):
        self.assert_error(run("optimize", "a.vtu", "b.vtu", "--method", "magic"), USAGE, "'magic'", "robust|thesis")
        self.assert_error(run("render", "a.vtu", "-o", "b.png", "--color", "0"), USAGE, "quality|level|patch|none")

    def test_options_without_effect(self):
        for option, value in (("--surface", "s.stl"), ("--feature-angle", 20), ("--max-deviation-rel", 0.01), ("--starts", 2),
                              ("--features", "l.csv")):
            for fixed in (("--boundary", "fixed"), ("--method", "thesis")):
                self.assert_error(run("optimize", "a.vtu", "b.vtu", *fixed, option, value), USAGE, option)
        self.assert_error(run("validate", "a.vtu", "--device", "cpu"), BAD_INPUT)
        self.assert_error(run("optimize", "a.vtu", "b.vtu", "--features-reach", 0.01), USAGE, "--features-reach", "--features")
        for flag in ("--weak-features", "--noise-angle", "--narrow-features"): # which need cells
            self.assert_error(run("domain", "a.stl", "-o", "a.hxd", flag, "0"), USAGE, flag)

    def test_unknown_sample(self):
        self.assert_error(run("sample", "teapot", "-o", self.path("a.vtu")), USAGE, "teapot")

    def test_unknown_output_format(self):
        mesh = self.make()
        self.assert_error(run("optimize", mesh, self.path("out.docx")), USAGE, "out.docx")

    def test_help_and_version(self):
        for arguments in (["--help"], ["--version"], ["optimize", "--help"], ["sample", "--help"]):
            result = run(*arguments)
            self.assertEqual(result.returncode, OK)
            self.assertIn("hexopt-gpu", result.stdout)
            self.assertEqual(result.stderr, "")

    def test_full_standard_output_is_reported(self):
        with open("/dev/full", "w") as full:
            result = subprocess.run([COMMAND, "--version"], stdout=full, stderr=subprocess.PIPE, text=True)
        self.assert_error(result, OUTPUT_FAILED, "standard output")


class Sample(Command):
    def test_geometries(self):
        self.make("airfoil.stl", "airfoil", "--airfoil", "23012", "--size", 40)
        text = self.path("airfoil.stl").read_text()
        self.assertEqual(text.count("solid airfoil\n"), 2)
        self.make("pipe.obj", "cylinder")
        self.assertIn("g wall\n", self.path("pipe.obj").read_text())
        self.make("pipe.stl", "cylinder", "--size", 12, "--binary")
        self.assertEqual(self.path("pipe.stl").stat().st_size, 84 + 50 * 48)

    def test_options_of_the_other_kind_are_refused(self):
        self.assert_error(run("sample", "cylinder", "-o", self.path("a.stl"), "--levels", 2), USAGE, "--levels")
        self.assert_error(run("sample", "grid", "-o", self.path("a.vtu"), "--binary"), USAGE, "--binary")
        self.assert_error(run("sample", "cylinder", "-o", self.path("a.vtu")), USAGE, "a.vtu")
        self.assert_error(run("sample", "cylinder", "-o", self.path("a.stl"), "--airfoil", "0012"), USAGE, "airfoil")
        self.assert_error(run("sample", "wing", "-o", self.path("a.stl"), "--airfoil", "99999"), USAGE, "99999")


class Mesh(Command):
    def surface(self):
        return self.make("pipe.stl", "cylinder", "--size", 16)

    def test_mesh_with_configuration(self):
        config = self.path("config.toml")
        config.write_text("[refine]\ncells = 100\n[output]\nencoding = 'text'\n[patches.inlet]\nlevel = 1\n")
        result = run("mesh", self.surface(), "-o", self.path("out.vtk"), "-c", config, "--cells", 600, "--report",
                     self.path("report.json"))
        self.assertEqual(result.returncode, OK, result.stderr)
        report = json.loads(self.path("report.json").read_text())
        self.assertEqual(report["options"]["refine.cells"], 600)
        self.assertEqual(report["options"]["patches.inlet.level"], 1)
        self.assertIn(b"ASCII", self.path("out.vtk").read_bytes()[:200])
        self.assertEqual(run("quality", self.path("out.vtk"), "--require-valid").returncode, OK)

    @unittest.skipIf(SANITIZED, "sanitizers need memory of their own")
    def test_peak_memory(self):
        surface = self.make("joint.stl", "three-pipe-joint")
        result = run("mesh", surface, "-o", self.path("out.vtu"), "--cells", 40000, "--threads", 1, "--report",
                     self.path("report.json"))
        self.assertEqual(result.returncode, OK, result.stderr)
        report = json.loads(self.path("report.json").read_text())
        cells = report["quality_after"]["cells"]
        self.assertGreater(cells, 32000)
        self.assertLess(report["stages"][-1]["peak_memory_bytes"], 24e6 + 1024 * cells)

    def test_device_that_optimizes(self):
        common = ["mesh", self.surface(), "-o", self.path("out.vtu"), "--cells", 600]
        self.assert_error(run(*common, "--device", "teapot"), DEVICE, "teapot")
        result = run(*common, "--device", "cpu", "--precision", "mixed", "--report", self.path("report.json"))
        self.assertEqual(result.returncode, OK, result.stderr)
        self.assertIn("optimized on cpu", result.stdout)
        report = json.loads(self.path("report.json").read_text())
        self.assertEqual(report["options"]["optimize.precision"], "mixed")
        self.assertTrue(report["device"].startswith("cpu"), report["device"])

    def test_dumped_configuration_is_read(self):
        dumped = run("mesh", "--dump-config", "--size", 0.25, "--seeds", "0,0,1,2,0,0", "--patch-size", "a b=0.5",
                     "--region", "sphere 0,0,0,1 size=1", "--region", "patch wall level=2")
        self.assertEqual(dumped.returncode, OK, dumped.stderr)
        config = self.path("config.toml")
        config.write_text(dumped.stdout)
        again = run("mesh", "--dump-config", "-c", config)
        self.assertEqual(again.stdout, dumped.stdout)
        self.assertIn("size = 0.25", again.stdout)

    def test_domain_file_gives_the_same_mesh(self):
        surface, domain = self.surface(), self.path("pipe.hxd")
        self.assertEqual(run("domain", surface, "-o", domain, "--feature-angle", 40).returncode, OK)
        flags = ("--feature-angle", 40, "--weak-features", "no")
        for source, out, options in ((surface, "a.vtu", flags), (domain, "b.vtu", ())):
            result = run("mesh", source, "-o", self.path(out), "--cells", 600, *options)
            self.assertEqual(result.returncode, OK, result.stderr)
        self.assertEqual(self.path("a.vtu").read_bytes(), self.path("b.vtu").read_bytes())
        again = self.path("again.hxd")
        self.assertEqual(run("domain", domain, "-o", again).returncode, OK)
        self.assertEqual(domain.read_bytes(), again.read_bytes())

    def test_given_feature_lines(self):
        surface, lines, domain = self.surface(), self.path("belt.csv"), self.path("pipe.hxd")
        ring = [line.split() for line in surface.read_text().splitlines() if "vertex" in line]
        low = min(float(z) for _, _, _, z in ring)
        lines.write_text("\n".join(f"{x},{y},{z}" for _, x, y, z in ring[:2]) + "\n")
        options = ("--feature-angle", 180, "--patch-borders", "no")
        self.assertIn(" 0 feature curves", run("domain", surface, "-o", domain, *options).stdout)
        result = run("domain", surface, "-o", domain, *options, "--features", lines)
        self.assertIn(" 1 feature curves", result.stdout, result.stderr)
        lines.write_text(f"0,0,{low - 1}\n0,0,{low - 2}\n")
        self.assert_error(run("domain", surface, "-o", domain, "--features", lines), BAD_INPUT, "belt.csv near (0, 0,")
        self.assert_error(run("mesh", surface, "-o", self.path("out.vtu"), "--features", self.path("none.obj")),
                          BAD_INPUT, "none.obj")

    def test_features_of_domain_files_that_need_cells(self):
        domain = self.path("in.hxd")
        self.assertEqual(run("domain", self.surface(), "-o", domain).returncode, OK)
        result = run("mesh", domain, "-o", self.path("out.vtu"), "--cells", 500, "--noise-angle", 0, "--narrow-features", 0)
        self.assertEqual(result.returncode, OK, result.stderr)
        self.assert_error(run("mesh", domain, "-o", self.path("out.vtu"), "--feature-angle", 20), USAGE, "--feature-angle")
        outline = self.path("a.dat")
        outline.write_text("0 0\n1 0\n1 1\n")
        self.assert_error(run("domain", outline, "-o", domain), USAGE, "a.dat")

    def test_most_cells(self):
        out = self.path("out.vtu")
        result = run("mesh", self.surface(), "-o", out, "--max-cells", 2000, "--report", self.path("report.json"))
        self.assertEqual(result.returncode, OK, result.stderr)
        report = json.loads(self.path("report.json").read_text())
        self.assertLess(report["quality_after"]["cells"], 2000)
        self.assertGreater(report["quality_after"]["cells"], 500)
        self.assertEqual(report["options"]["refine.max_cells"], 2000)
        result = run("mesh", self.surface(), "-o", out, "--level", 1, "--max-cells", 8)
        self.assertEqual(result.returncode, OK, result.stderr)
        self.assertIn("more cells than --max-cells 8", result.stdout)

    def test_openfoam_is_not_read(self):
        marker = self.path("case.foam")
        marker.touch()
        self.assert_error(run("quality", marker), BAD_INPUT, "OpenFOAM", ".vtu")

    def test_bad_domain_files(self):
        surface, domain, out = self.surface(), self.path("pipe.hxd"), self.path("out.vtu")
        self.assertEqual(run("domain", surface, "-o", domain).returncode, OK)
        self.assert_error(run("domain", surface, "-o", self.path("pipe.stl2")), USAGE, ".hxd")
        self.assert_error(run("mesh", domain, "-o", out, "--feature-angle", 40), USAGE, "--feature-angle")
        self.assert_error(run("mesh", domain, surface, "-o", out), USAGE, "alone")
        text = domain.read_text()
        domain.write_text(text.replace("patch 2 ", "patsch 2 "))
        line = 1 + text[:text.index("patch 2 ")].count("\n")
        self.assert_error(run("mesh", domain, "-o", out), BAD_INPUT, f"pipe.hxd:{line}:", "patsch")
        domain.write_text(text[:-5])
        self.assert_error(run("mesh", domain, "-o", out), BAD_INPUT, "pipe.hxd:")
        self.assertFalse(out.exists())

    def test_page_of_a_report(self):
        report, page, later = self.path("report.json"), self.path("page.html"), self.path("later.html")
        out = self.path("out.vtu")
        result = run("mesh", self.surface(), "-o", out, "--cells", 600, "--report", report, "--html", page)
        self.assertEqual(result.returncode, OK, result.stderr)
        result = run("report", report, "-o", later)
        self.assertEqual(result.returncode, OK, result.stderr)
        self.assertEqual(later.read_text().count("data:image/png"), page.read_text().count("data:image/png"))
        self.assert_error(run("report", report, "-o", report), USAGE, "report.json")
        out.unlink()
        self.assert_error(run("report", report, "-o", later), BAD_INPUT, "out.vtu", "--no-pictures")
        self.assertEqual(run("report", report, "-o", later, "--no-pictures").returncode, OK)
        report.write_text('{"quality_after": {"cells": 1e999}}')
        self.assert_error(run("report", report, "-o", later), BAD_INPUT, "report.json", "too large")

    def test_outputs_are_checked_first(self):
        """Before anything is read, so that no other error hides these and no hours are lost."""
        surface = self.path("none.stl")
        out, case = self.path("out.vtu"), self.path("case")
        (case / "constant" / "polyMesh").mkdir(parents=True)
        (case / "constant" / "polyMesh" / "mine").touch()
        for code, word, *arguments in (
                (USAGE, "two outputs", "-o", out, "--report", out),
                (USAGE, "two outputs", "-o", out, "--report", self.path("a"), "--html", self.folder / "." / "a"),
                (USAGE, "would be lost", "-o", out, "--report", surface),
                (USAGE, "would be lost", "-o", out, "--initial-mesh", out),
                (USAGE, "would be lost", "-o", self.path("l.vtk"), "--features", self.path("l.vtk")),
                (USAGE, ".png", "-o", out, "--picture", self.path("a.jpg")),
                (USAGE, "binary", "-o", self.path("a.mesh"), "--encoding", "binary"),
                (USAGE, "polyhedra", "-o", self.path("a.vtk"), "--polyhedra", "yes"),
                (OUTPUT_FAILED, "'mine'", "-o", case / "x.foam"),
                (OUTPUT_FAILED, "create it first", "-o", self.path("no/such/x.foam")),
                (OUTPUT_FAILED, "directory", "-o", out, "--html", case)):
            with self.subTest(word=word, arguments=arguments):
                self.assert_error(run("mesh", surface, *arguments), code, word)
        mesh = self.make()
        kept = mesh.read_bytes()
        self.assert_error(run("optimize", mesh, out, "--report", mesh), USAGE, "would be lost")
        self.assert_error(run("quality", mesh, "--json", mesh), USAGE, "would be lost")
        self.assert_error(run("render", mesh, "-o", mesh), USAGE, ".png")
        self.assertEqual(mesh.read_bytes(), kept)

    @unittest.skipIf(os.geteuid() == 0, "root may write everywhere")
    def test_folder_that_may_not_be_written_to(self):
        closed = self.path("closed")
        closed.mkdir(mode=0o555)
        self.assert_error(run("mesh", self.path("none.stl"), "-o", closed / "out.vtu"), OUTPUT_FAILED, "closed")

    def test_bad_arguments(self):
        config = self.path("config.toml")
        config.write_text("[refine]\nmax_cels = 5\n")
        surface = self.surface()
        out = self.path("out.vtu")
        self.assert_error(run("mesh", surface, "-o", out, "-c", config), USAGE, "config.toml:2", "refine.max_cells")
        self.assert_error(run("mesh", surface, "-o", out, "--rings", "x"), USAGE, "--rings")
        self.assert_error(run("mesh", surface, "-o", out, "--rings", "99"), USAGE, "--rings")
        self.assert_error(run("mesh", surface, "-o", out, "--patch-size", "wall"), USAGE, "--patch-size")
        self.assert_error(run("mesh", surface, "-o", out, "--patch-size", "roof=1"), USAGE, "roof")
        config.write_text("[features]\nfeature_angle = 20\n") # the flag's name
        self.assert_error(run("mesh", surface, "-o", out, "-c", config), USAGE, "'features.angle'")
        self.assert_error(run("mesh", surface, "-o", out, "--size", 1, "--level", 2), USAGE, "--level", "--size")
        self.assert_error(run("mesh", surface, "-o", out, "--patch-size", "wall=1", "--patch-level", "wall=1"),
                          USAGE, "--patch-level", "'wall'")
        self.assert_error(run("mesh", surface, "-o", out, "--cells", 9, "--cells", 8), USAGE, "--cells", "more than once")
        self.assert_error(run("mesh", surface, "-o", out, "--cells"), USAGE, "--cells", "missing")
        self.assert_error(run("mesh", surface, "-o", out, "--thickness", 1), USAGE, "--thickness")
        self.assert_error(run("mesh", surface), USAGE, "-o")
        self.assert_error(run("mesh", "-o", out), USAGE, "SURFACE")
        self.assert_error(run("mesh", self.path("none.stl"), "-o", out), BAD_INPUT, "none.stl")
        self.assert_error(run("mesh", surface, "-o", self.path("out.docx")), USAGE, "out.docx")
        self.assertFalse(out.exists())


class Optimize(Command):
    def test_valid_mesh_and_report(self):
        mesh = self.make("in.vtu", "grid", "--size", 5, "--tangled", 0.2)
        result = run("optimize", mesh, self.path("out.vtk"), "--report", self.path("report.json"),
                     "--picture", self.path("picture.png"))
        self.assertEqual(result.returncode, OK, result.stderr)
        self.assertEqual(self.path("picture.png").read_bytes()[:4], b"\x89PNG")
        report = json.loads(self.path("report.json").read_text())
        self.assertEqual(report["exit_code"], OK)
        self.assertGreater(report["quality_before"]["validity"]["concave32"], 0)
        checked = run("quality", self.path("out.vtk"), "--require-valid")
        self.assertEqual(checked.returncode, OK, checked.stderr)

    def test_same_input_same_bytes(self):
        mesh = self.make("in.vtu", "octree-corner", "--tangled", 0.2)
        for name, threads in (("a.vtu", 1), ("b.vtu", 2)):
            self.assertEqual(run("optimize", mesh, self.path(name), "--threads", threads).returncode, OK)
        self.assertEqual(self.path("a.vtu").read_bytes(), self.path("b.vtu").read_bytes())

    def test_quiet_says_nothing(self):
        result = run("optimize", self.make(), self.path("out.vtu"), "--quiet")
        self.assertEqual((result.returncode, result.stdout, result.stderr), (OK, "", ""))

    def test_surface(self):
        mesh = self.make("in.vtu", "grid", "--size", 4)
        surface = self.path("surface.off")
        surface.write_text("OFF\n8 6 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
                           "4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n")
        result = run("optimize", mesh, self.path("out.vtu"), "--surface", surface)
        self.assertEqual(result.returncode, OK, result.stderr)
        self.assert_error(run("optimize", mesh, self.path("out.vtu"), "--surface", self.path("none.stl")),
                          BAD_INPUT, "none.stl")

    def test_given_feature_lines(self):
        mesh, out, lines, report = self.make("in.vtu", "grid", "--size", 4), self.path("out.vtu"), self.path("l.csv"), self.path("r.json")
        lines.write_text("0.5,0,1\n0.5,1,1\n\n0,0.5,0.003\n1,0.5,0.003\n")
        self.assert_error(run("optimize", mesh, out, "--features", lines), BAD_INPUT, "l.csv near (0, 0.5, 0.003)")
        result = run("optimize", mesh, out, "--features", lines, "--features-reach", 0.002, "--report", report)
        self.assertEqual(result.returncode, OK, result.stderr)
        options = json.loads(report.read_text())["options"]
        self.assertEqual((options["features"], options["features_reach_rel"]), ([str(lines)], 0.002))
        lines.write_text("0.3,0,1\n0.3,1,1\n")
        self.assert_error(run("optimize", mesh, out, "--features", lines), BAD_INPUT, "l.csv near (0.3, 0, 1)", "no vertex")
        lines.write_text("0,0,0\n1,0,nan\n")
        self.assert_error(run("optimize", mesh, out, "--features", lines), BAD_INPUT, "l.csv: point 1")
        self.assert_error(run("optimize", mesh, out, "--features", self.path("none.obj")), BAD_INPUT, "none.obj")
        self.assert_error(run("optimize", mesh, self.path("l.vtk"), "--features", self.path("l.vtk")), USAGE, "would be lost")

    def test_input_may_be_the_output(self):
        mesh = self.make("in.vtu", "grid", "--size", 5, "--tangled", 0.2)
        self.assertEqual(run("optimize", mesh, mesh).returncode, OK)
        self.assertEqual(run("quality", mesh, "--require-valid").returncode, OK)

    def test_missing_and_damaged_input(self):
        self.assert_error(run("optimize", self.path("none.vtu"), self.path("out.vtu")), BAD_INPUT, "none.vtu")
        damaged = self.path("damaged.vtu")
        damaged.write_bytes(self.make().read_bytes()[:600])
        self.assert_error(run("optimize", damaged, self.path("out.vtu")), BAD_INPUT, "damaged.vtu")
        self.assertFalse(self.path("out.vtu").exists())

    def test_output_that_cannot_be_written(self):
        mesh = self.make()
        self.assert_error(run("optimize", mesh, self.path("no/such/out.vtu")), OUTPUT_FAILED, "no/such")
        self.assert_error(run("optimize", mesh, self.path("out.vtu"), "--report", self.folder), OUTPUT_FAILED)

    def test_full_disk_leaves_the_old_output(self):
        mesh = self.make("in.vtu", "grid", "--size", 12, "--tangled", 0.2)
        output = self.path("out.vtu")
        output.write_text("old")
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
        result = run("optimize", mesh, output, preexec_fn=limit)
        self.assert_error(result, OUTPUT_FAILED, "out.vtu")
        self.assertEqual(output.read_text(), "old")
        self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["in.vtu", "out.vtu"])

    def test_no_valid_mesh_is_written_and_said(self):
        mesh = self.path("inverted.vtk")
        mesh.write_text(INVERTED_CUBE)
        result = run("optimize", mesh, self.path("out.vtk"), "--boundary", "fixed")
        self.assert_error(result, NO_VALID_MESH, "1 of 1 cells", "cell 0")
        self.assertTrue(self.path("out.vtk").exists())

    def test_below_target(self):
        mesh = self.make("in.vtu", "grid-warped", "--size", 6)
        options = ["--boundary", "fixed", "--min-sj", 0.999]
        self.assert_error(run("optimize", mesh, self.path("out.vtu"), *options), BELOW_TARGET, "0.999")
        self.assertTrue(self.path("out.vtu").exists())

    @unittest.skipIf(SANITIZED, "sanitizers need the address space")
    def test_out_of_memory(self):
        mesh = self.make("in.vtu", "grid", "--size", 60)
        limit = lambda: resource.setrlimit(resource.RLIMIT_AS, (120 << 20, 120 << 20))
        result = run("optimize", mesh, self.path("out.vtu"), "--threads", 1, preexec_fn=limit)
        self.assert_error(result, MEMORY)
        self.assertFalse(self.path("out.vtu").exists())


class OpenFoam(Command):
    """OpenFOAM's own check. A perfect octree draws its notice of concave cells too: a face of 2 by 2 makes one."""

    @classmethod
    def setUpClass(cls):
        if shutil.which("checkMesh") is None:
            print("SKIPPED: no checkMesh; install Debian's openfoam")
            raise unittest.SkipTest("no checkMesh")

    def check(self, case):
        system = case / "system"
        system.mkdir()
        header = "FoamFile { version 2.0; format ascii; class dictionary; object %s; }\n"
        (system / "controlDict").write_text(
            header % "controlDict" + "startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1;"
                                     "writeControl timeStep; writeInterval 1;\n")
        schemes = "".join(f"{n}Schemes {{ default none; }}\n"
                          for n in ("ddt", "grad", "div", "laplacian", "interpolation", "snGrad"))
        (system / "fvSchemes").write_text(header % "fvSchemes" + schemes)
        (system / "fvSolution").write_text(header % "fvSolution")
        environment = {"WM_PROJECT_DIR": "/usr/share/openfoam", **os.environ}
        result = subprocess.run(["checkMesh", "-case", case, "-allTopology", "-allGeometry"], capture_output=True,
                                text=True, timeout=120, env=environment)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        complaints = [line for line in result.stdout.splitlines() if line.lstrip().startswith("***")]
        unexpected = [line for line in complaints if "Concave cells (using face planes)" not in line]
        self.assertEqual(unexpected, [], result.stdout)
        self.assertIn("Failed 1 mesh checks." if complaints else "Mesh OK.", result.stdout)
        return result.stdout

    def case(self, name):
        folder = self.path(name)
        folder.mkdir()
        return folder

    def test_samples(self):
        for sample in ("grid", "octree-corner", "octree-sphere", "octree-halved", "octree-trimmed", "octree-ball"):
            with self.subTest(sample=sample):
                case = self.case(sample)
                self.make(f"{sample}/mesh.foam", sample)
                output = self.check(case)
                self.assertEqual("polyhedra:     0\n" in output, sample == "grid")

    def test_meshed_surface(self):
        surface = self.make("pipe.stl", "cylinder", "--size", 16)
        for encoding in ("binary", "text"):
            case = self.case(encoding)
            result = run("mesh", surface, "-o", case / "mesh.foam", "--cells", 600, "--encoding", encoding)
            self.assertEqual(result.returncode, OK, result.stderr)
            self.check(case)
            self.assertIn("outlet", (case / "constant/polyMesh/boundary").read_text())

    def test_warped_faces_are_flattened(self):
        surface = self.make("joint.stl", "three-pipe-joint")
        case = self.case("joint")
        report = self.path("joint.json")
        result = run("mesh", surface, "-o", case / "mesh.foam", "--cells", 1500, "--report", report)
        self.assertEqual(result.returncode, OK, result.stderr)
        warped = json.loads(report.read_text())["warped_faces"]
        self.assertGreater(warped["before"], 0)
        self.assertEqual(warped["after"], 0)
        self.check(case)

    def test_optimized_mesh(self):
        mesh = self.make("in.vtu", "octree-ball", "--size", 4, "--tangled", 0.2)
        case = self.case("optimized")
        result = run("optimize", mesh, case / "mesh.foam")
        self.assertEqual(result.returncode, OK, result.stderr)
        self.check(case)

    def test_faces_of_optimized_meshes_are_flattened_for_openfoam(self):
        mesh = self.make("in.vtu", "octree-ball", "--size", 4, "--tangled", 0.2)
        report = self.path("report.json")
        for output, choice, flattened in (("a.foam", (), True), ("b.foam", ("--flatten", "no"), False),
                                          ("c.vtu", (), False), ("d.vtu", ("--flatten", "yes"), True)):
            result = run("optimize", mesh, self.case(output[0]) / output, *choice, "--report", report)
            self.assertEqual(result.returncode, OK, result.stderr)
            told = json.loads(report.read_text())
            self.assertEqual(told["options"]["flatten"], flattened)
            self.assertEqual(told["warped_faces"] is not None, flattened)
            self.assertEqual("flatten" in [stage["stage"] for stage in told["stages"]], flattened)


class Device(Command):
    def test_unknown_device(self):
        result = run("optimize", self.make(), self.path("out.vtu"), "--boundary", "fixed", "--device", "teapot")
        self.assert_error(result, DEVICE, "teapot")

    def test_what_only_the_host_does_is_refused(self):
        mesh = self.make()
        for option in (("--device", "vulkan"), ("--precision", "f32")):
            result = run("optimize", mesh, self.path("out.vtu"), "--method", "thesis", *option)
            self.assert_error(result, USAGE, "thesis")

    def test_kernels_let_the_boundary_slide(self):
        mesh = self.make("in.vtu", "grid", "--size", 4, "--tangled", 0.2)
        result = run("optimize", mesh, self.path("out.vtu"), "--device", "cpu", "--precision", "mixed")
        self.assertEqual(result.returncode, OK, result.stderr)

    def test_single_precision_kernels(self):
        mesh = self.make("in.vtu", "grid", "--size", 4, "--tangled", 0.2)
        result = run("optimize", mesh, self.path("out.vtu"), "--boundary", "fixed", "--device", "cpu",
                     "--precision", "f32", "--report", self.path("report.json"), "--html", self.path("page.html"))
        self.assertEqual(result.returncode, OK, result.stderr)
        self.assertEqual(json.loads(self.path("report.json").read_text())["options"]["precision"], "f32")
        self.assertIn("<html", self.path("page.html").read_text())


class Interrupt(Command):
    def interrupt(self, number, *options):
        """Signals a run as soon as it optimizes; returns its exit code and stderr."""
        mesh = self.make("in.vtu", "octree-warped", "--size", 10, "--tangled", 0.3)
        self.path("out.vtu").write_text("old")
        process = subprocess.Popen([COMMAND, "optimize", mesh, self.path("out.vtu"), *options],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        seen = ""
        for line in process.stderr:
            seen += line
            if "untangle" in line:
                process.send_signal(number)
                break
        seen += process.stderr.read()
        process.stderr.close()
        return process.wait(timeout=60), seen

    def test_interrupt_leaves_the_old_output(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            code, stderr = self.interrupt(number)
            self.assertEqual(code, CANCELLED, stderr)
            self.assertEqual(self.path("out.vtu").read_text(), "old")
            self.assertEqual(sorted(p.name for p in self.folder.iterdir()), ["in.vtu", "out.vtu"])

    def test_interrupt_with_keep_best_writes(self):
        code, stderr = self.interrupt(signal.SIGINT, "--keep-best")
        self.assertEqual(code, CANCELLED, stderr)
        self.assertEqual(run("quality", self.path("out.vtu")).returncode, OK)

    def kill_at_checkpoint(self, arguments):
        """Kills a run as soon as it has kept a state."""
        process = subprocess.Popen([COMMAND, *map(str, arguments)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        state = self.path("state") / "mesh.checkpoint"
        while not state.exists() and process.poll() is None:
            time.sleep(0.002)
        process.kill()
        self.assertEqual(process.wait(timeout=60), -signal.SIGKILL, "it ended before it was killed")

    def test_killed_run_goes_on(self):
        surface = self.make("in.stl", "wing")
        common = ["mesh", surface, "--size", 14, "--repairs", 0, "--threads", 1]
        self.assertEqual(run(*common, "-o", self.path("whole.vtu")).returncode, OK)
        kept = [*common, "-o", self.path("out.vtu"), "--checkpoint", self.path("state")]
        self.kill_at_checkpoint(kept)
        self.assertFalse(self.path("out.vtu").exists())
        self.assert_error(run(*kept), USAGE, "--resume")
        self.assert_error(run(*kept, "--resume", "--gap-cells", 2), USAGE, "refine.gap_cells was 3 and is 2")
        result = run(*kept, "--resume")
        self.assertEqual(result.returncode, OK, result.stderr)
        self.assertIn("going on with", result.stderr)
        self.assertEqual(self.path("out.vtu").read_bytes(), self.path("whole.vtu").read_bytes())
        self.assertFalse((self.path("state") / "mesh.checkpoint").exists())

    def test_checkpoint_that_cannot_be(self):
        surface = self.make("in.stl", "cylinder")
        common = ["mesh", surface, "-o", self.path("out.vtu"), "--cells", 800]
        self.assert_error(run(*common, "--resume"), USAGE, "--checkpoint")
        self.assert_error(run(*common, "--resume", "--checkpoint", self.path("none")), BAD_INPUT, "none")
        self.path("file").write_text("no folder")
        self.assert_error(run(*common, "--checkpoint", self.path("file")), OUTPUT_FAILED, "file")
        self.path("state").mkdir()
        (self.path("state") / "mesh.checkpoint").write_text("no state")
        self.assert_error(run(*common, "--resume", "--checkpoint", self.path("state")), BAD_INPUT, "mesh.checkpoint")
        self.assertFalse(self.path("out.vtu").exists())


if __name__ == "__main__":
    unittest.main()
