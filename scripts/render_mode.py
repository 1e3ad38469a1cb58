"""Render a vibration mode of a brake, without a display:

    xvfb-run -a pvbatch scripts/render_mode.py OUTPUT_DIR [--mode N] [--cycle C] [--phase DEG] [--scale METRES]
                                               [--output FILE.png] [--animation FILE.webp]

Left: all bodies as they vibrate together, the displacement Re[u exp(i phase)] enlarged. Right: the same, pads and parts
lifted off the rotor, without those that reach across it (a caliper). With --animation the left one over a period. Colour: the axial displacement u_z, in units of the largest component of the mode; the dark lines
across the rotor are the nodal lines u_z = 0.
Needs ParaView (Debian: apt-get install --no-install-recommends paraview python3-paraview xvfb xauth), animations Pillow, too
(python3-pil, which comes with python3-matplotlib).
"""

import argparse
import math
import os
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))  # pvbatch does not

from mode_choice import choose_mode, read_modes  # noqa: E402
from plotting import refuse_foreign, rounded  # noqa: E402

ROTOR = 0  # value of the field "body"
WIDTH, HEIGHT = 1600, 660  # pixels
FRAMES, PERIOD = int(os.environ.get("SQUEAL_FRAMES", 16)), 1.2  # of an animation: number (tests want few), seconds


def fail(message):
    print("render_mode.py: " + message, file=sys.stderr, flush=True)
    os._exit(2)  # pvbatch answers sys.exit with 0


def parse_arguments():
    parser = argparse.ArgumentParser(prog="xvfb-run -a pvbatch scripts/render_mode.py",
                                     description="Render a vibration mode of a brake.")
    parser.add_argument("directory", metavar="OUTPUT_DIR", help="output directory of a run, e.g. output/brake")
    parser.add_argument("--mode", type=int, metavar="N",
                        help="its number in modes.csv; default: of those written, the one growing fastest")
    parser.add_argument("--cycle", type=int, metavar="C", help="refinement cycle; default: the last one")
    parser.add_argument("--phase", type=float, default=0, metavar="DEG",
                        help="instant in the period, degrees; default 0")
    parser.add_argument("--scale", type=float, metavar="METRES",
                        help="largest displacement drawn; default: rotor radius / 14")
    parser.add_argument("--output", metavar="FILE.png", help="default: mode-C-N.png in OUTPUT_DIR")
    parser.add_argument("--animation", metavar="FILE.webp", help="an animation over one period, in place of the picture")
    return parser.parse_args()


def caption(cycle, mode, line):
    words = f"mode {mode}"
    if cycle > 0:
        words += f" of cycle {cycle}"
    if line:
        growth, bar = float(line["growth_rate_1_per_s"]), line.get("growth_rate_error_1_per_s")
        growth = " \N{PLUS-MINUS SIGN} ".join(rounded(growth, float(bar))) if bar else f"{growth:+#.3g}".rstrip(".")
        words = f"{line['verdict']}, {words}: {float(line['frequency_hz']):.0f} Hz, {growth} 1/s"
    return words[0].upper() + words[1:]


class Bodies:
    """The parts of the brake at one instant of the vibration, ready to be shown."""

    def __init__(self, pv, path, phase):
        self.pv = pv
        reader = pv.XMLPartitionedUnstructuredGridReader(FileName=[path])
        reader.UpdatePipeline()
        names = reader.PointData.keys()
        for name in ("displacement_re_m", "displacement_im_m", "body"):
            if name not in names:
                fail(f"{path} has no field {name}; it has: {', '.join(names)}")
        # Of all phases, so that pictures of several phases share their scales.
        parts = [reader.PointData[name] for name in ("displacement_re_m", "displacement_im_m")]
        self.largest = max(abs(value) for part in parts for value in part.GetRange(2)) or 1
        self.size = max(part.GetRange(-1)[1] for part in parts) or 1
        bounds = reader.GetDataInformation().GetBounds()
        self.radius = max(abs(value) for value in bounds[:4])
        self.thickness = bounds[5] - bounds[4]
        # A caliper reaches out of the pictures of a disc.
        self.distance = (6 if reader.PointData["body"].GetRange(0)[1] <= 2 else 7.2) * self.radius
        self.surfaces, self.motions, heights = {}, [], {}
        for body in range(round(reader.PointData["body"].GetRange(0)[1]) + 1):
            # Not Threshold: in ParaView 5.11.0 (Debian 12) it crashes now and then on what was read from a .pvtu.
            part = reader
            for value, below in ((body - 0.5, 0), (body + 0.5, 1)):
                part = pv.Clip(Input=part, ClipType="Scalar", Scalars=["POINTS", "body"], Value=value, Invert=below)
            part.UpdatePipeline()
            if part.GetDataInformation().GetNumberOfCells() == 0:
                continue
            heights[body] = part.GetDataInformation().GetBounds()[4:]
            # Cells do not share points in the file: weld them, or each would show its own faces.
            part = pv.ExtractSurface(Input=pv.CleantoGrid(Input=part))
            part = pv.Calculator(Input=part, ResultArrayName="u")
            self.motions.append(part)
            self.surfaces[body] = pv.Calculator(Input=part, ResultArrayName="u_z", Function="u_Z")
        # Between the pads, which are the first bodies after the rotor; with a hat that is not the rotor's middle.
        pads = [heights[body] for body in (1, 2) if body in heights] if len(heights) > 2 else list(heights.values())[:1]
        middle = sum(map(sum, pads)) / 2 / len(pads)
        # 1 above the middle, -1 below, 0 on both sides
        self.sides = {body: (low > middle) - (high < middle) for body, (low, high) in heights.items()}
        self.sides[ROTOR] = 0
        self.set_phase(phase)

    def set_phase(self, phase):
        angle = math.radians(phase)
        for motion in self.motions:
            motion.Function = (f"displacement_re_m*({math.cos(angle):.16g})"
                               f" - displacement_im_m*({math.sin(angle):.16g})")

    def displaced(self, source, scale, lift):
        """A surface or line moved by the displacement times scale and lifted along the axis."""
        return self.pv.Calculator(Input=source, CoordinateResults=1, ResultArrayName="x",
                                  Function=f"coords + {scale:.10g}*u + {lift:.10g}*kHat")


def show(pv, view, bodies, scale, lift):
    """All bodies in one view; lifted, those on one side of the rotor are moved away from it, others left out."""
    for body, surface in bodies.surfaces.items():
        if lift and body != ROTOR and bodies.sides[body] == 0:
            continue
        offset = bodies.sides[body] * lift
        moved = bodies.displaced(surface, scale, offset)
        smooth = pv.GenerateSurfaceNormals(Input=moved, FeatureAngle=40)
        display = pv.Show(smooth, view)
        pv.ColorBy(display, ("POINTS", "u_z"))
        display.Specular = 0
        display.Ambient = 0.35
        display.Diffuse = 0.7
        edges = pv.FeatureEdges(Input=surface, FeatureAngle=40, BoundaryEdges=0, ManifoldEdges=0, NonManifoldEdges=0)
        lines = [edges]
        if body == ROTOR:
            lines.append(pv.Contour(Input=surface, ContourBy=["POINTS", "u_z"], Isosurfaces=[0]))
        for line in lines:
            line = pv.Show(bodies.displaced(line, scale, offset), view)
            line.ColorArrayName = ["POINTS", ""]
            line.AmbientColor = line.DiffuseColor = [0.15, 0.15, 0.15]
            line.LineWidth = 3
            line.RenderLinesAsTubes = 1
            line.Ambient, line.Diffuse = 1, 0
    pv.HideUnusedScalarBars(view)


def make_view(pv, size):
    view = pv.CreateView("RenderView")
    view.ViewSize = size
    view.UseColorPaletteForBackground = 0
    view.BackgroundColorMode = "Single Color"
    view.Background = [1, 1, 1]
    view.OrientationAxesVisibility = 0
    view.UseFXAA = 1
    return view


def look(view, centre, direction, distance, angle):
    elevation, azimuth = (math.radians(value) for value in direction)
    eye = (math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation))
    view.CameraFocalPoint = centre
    view.CameraPosition = [c + distance * e for c, e in zip(centre, eye)]
    view.CameraViewUp = [0, 0, 1]
    view.CameraViewAngle = angle


def label(pv, view, text, position, size, bold=False):
    display = pv.Show(pv.Text(Text=text), view)
    display.WindowLocation = "Any Location"
    display.Position = position
    display.FontSize = size
    display.Color = [0, 0, 0]
    display.Bold = int(bold)


def colours(pv, bodies):
    table = pv.GetColorTransferFunction("u_z")
    table.AutomaticRescaleRangeMode = "Never"
    table.ApplyPreset("Cool to Warm", True)
    table.Discretize, table.NumberOfTableValues = 1, 50  # hardly visible steps, a file of half the size
    table.RescaleTransferFunction(-bodies.largest, bodies.largest)
    return table


def animate(pv, path, bodies, scale, words):
    """One period, as a browser plays it."""
    try:
        from PIL import Image
    except ImportError as error:
        fail(f"an animation needs Pillow ({error}). Debian: apt-get install python3-pil")
    view = make_view(pv, [WIDTH // 2, HEIGHT])
    show(pv, view, bodies, scale, 0)
    look(view, [0, 0, 0.05 * bodies.radius], (52, 0), bodies.distance, 20)
    label(pv, view, words, [0.03, 0.92], 27, bold=True)
    colours(pv, bodies)
    frames = []
    with tempfile.TemporaryDirectory() as scratch:
        for frame in range(FRAMES):
            bodies.set_phase(360 * frame / FRAMES)
            picture = os.path.join(scratch, "frame.png")
            pv.SaveScreenshot(picture, view, ImageResolution=[WIDTH // 2, HEIGHT], OverrideColorPalette="WhiteBackground")
            with Image.open(picture) as image:
                frames.append(image.convert("RGB"))
    try:
        frames[0].save(path, save_all=True, append_images=frames[1:], duration=round(1000 * PERIOD / FRAMES), loop=0,
                       quality=60)
    except (OSError, ValueError) as error:
        fail(f"{path} was not written: {error}")


def render(pv, arguments, path, words):
    pv._DisableFirstRenderCameraReset()
    bodies = Bodies(pv, path, arguments.phase)
    scale = (arguments.scale or bodies.radius / 14) / bodies.size
    if arguments.animation:
        animate(pv, arguments.animation, bodies, scale, words)
        return
    layout = pv.CreateLayout("mode")
    left, right = make_view(pv, [WIDTH // 2, HEIGHT]), make_view(pv, [WIDTH // 2, HEIGHT])
    pv.AssignViewToLayout(left, layout, 0)
    layout.SplitHorizontal(0, 0.5)
    pv.AssignViewToLayout(right, layout, 2)
    layout.SetSize(WIDTH, HEIGHT)

    show(pv, left, bodies, scale, 0)
    show(pv, right, bodies, scale, min(1.65 * bodies.thickness, 0.4 * bodies.radius))
    look(left, [0, 0, 0.05 * bodies.radius], (52, 0), bodies.distance, 20)
    look(right, [0, 0, -0.13 * bodies.radius], (15, 12), bodies.distance, 20)
    label(pv, left, words, [0.03, 0.92], 27, bold=True)
    others = len(bodies.surfaces) - 1
    lifted = "pads" if others <= 2 else "pads and parts"
    label(pv, right, f"{lifted} lifted off the rotor, seen from the side", [0.16, 0.925], 23)

    table = colours(pv, bodies)
    bar = pv.GetScalarBar(table, right)
    bar.Title, bar.ComponentTitle = "axial displacement u_z (largest component = 1)", ""
    bar.TitleColor = bar.LabelColor = [0, 0, 0]
    bar.Orientation, bar.WindowLocation = "Horizontal", "Any Location"
    bar.Position, bar.ScalarBarLength, bar.ScalarBarThickness = [0.2, 0.01], 0.6, 14
    bar.TitleFontSize = bar.LabelFontSize = 22
    bar.UseCustomLabels, bar.AddRangeLabels = 1, 0
    bar.CustomLabels = [bodies.largest * x for x in (-1, -0.5, 0, 0.5, 1)]
    bar.AutomaticLabelFormat, bar.LabelFormat = 0, "%.2g"
    bar.Visibility = 1
    pv.SaveScreenshot(arguments.output, layout, ImageResolution=[WIDTH, HEIGHT], SeparatorWidth=0,
                      SeparatorColor=[1, 1, 1], OverrideColorPalette="WhiteBackground", CompressionLevel="9")
    if not os.path.isfile(arguments.output):
        fail(f"{arguments.output} was not written; is the directory writable?")


def main():
    arguments = parse_arguments()
    modes = read_modes(arguments.directory, fail)
    cycle, mode, path = choose_mode(arguments, modes, "pvtu", "; run with  --set \"Output/Fields=all\"", fail)
    if not os.environ.get("DISPLAY"):
        fail("there is no display; start it as  xvfb-run -a pvbatch scripts/render_mode.py ...")
    try:
        import paraview
        paraview.compatibility.major, paraview.compatibility.minor = 5, 11
        import paraview.simple as pv
    except ImportError as error:
        fail(f"ParaView cannot be loaded ({error}). Debian: apt-get install paraview python3-paraview xvfb xauth; "
             "start it as  xvfb-run -a pvbatch scripts/render_mode.py ...")
    named = arguments.output
    arguments.output = named or os.path.join(arguments.directory, f"mode-{cycle}-{mode:03d}.png")
    for output, is_named in ((arguments.output, named), (arguments.animation, True)):
        if output:
            refuse_foreign(output, is_named, fail, [b"\x89PNG"])  # ParaView leaves no mark
    render(pv, arguments, path, caption(cycle, mode, modes.get((cycle, mode))))
    print(arguments.animation or arguments.output)


main()
