#!/usr/bin/env python3
"""Write a ParaView state that shows a mode in motion, ready to be played:

    xvfb-run -a pvbatch scripts/paraview_state.py OUTPUT_DIR [--mode N] [--cycle C] [--scale FRACTION]
                                                  [--output FILE.pvsm] [--picture FILE.png]
    paraview OUTPUT_DIR/NAME.pvsm                       (NAME: that of OUTPUT_DIR; output/brake/brake.pvsm)

Left: rotor and pads over one period, displaced (Warp By Vector) and coloured by the displacement's magnitude. Right,
where the run wrote them: the work of friction on the mode and the steady contact pressure on the pads' faces, the
faces moved apart. Press play; the animation loops.

The state holds the full names of the run's files, so that it opens from any directory. If the run is moved, make the
state again, or let ParaView look for the files: "Search files under specified directory".
Opened without a display (pvbatch, LoadState), it needs an Xvfb that does not start anew between its views:
xvfb-run -a -s "-screen 0 1280x1024x24 -noreset" pvbatch ...
--picture also draws the first frame. Needs ParaView (scripts/install-dependencies.sh --pictures).
"""

import argparse
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))  # pvbatch does not

from mode_choice import choose_mode, read_modes  # noqa: E402
from plotting import refuse_foreign  # noqa: E402

SCALE = 0.03  # largest displacement drawn, relative to the diagonal of the model's box
GREY = [0.15, 0.15, 0.15]


def fail(message):
    print("paraview_state.py: " + message, file=sys.stderr, flush=True)
    os._exit(2)  # pvbatch answers sys.exit with 0


def parse_arguments():
    parser = argparse.ArgumentParser(prog="xvfb-run -a pvbatch scripts/paraview_state.py",
                                     description="Write a ParaView state that shows a mode in motion.")
    parser.add_argument("directory", metavar="OUTPUT_DIR", help="output directory of a run, e.g. output/brake")
    parser.add_argument("--mode", type=int, metavar="N",
                        help="its number in modes.csv; default: of those written, the one growing fastest")
    parser.add_argument("--cycle", type=int, metavar="C", help="mesh; default: the last one")
    parser.add_argument("--scale", type=float, metavar="FRACTION", default=SCALE,
                        help=f"largest displacement drawn, relative to the diagonal of the model's box; default {SCALE:g}")
    parser.add_argument("--output", metavar="FILE.pvsm", help="default: <name of OUTPUT_DIR>.pvsm in OUTPUT_DIR")
    parser.add_argument("--picture", metavar="FILE.png", help="also draw the first frame")
    return parser.parse_args()


def caption(mode, line):
    if not line:
        return f"Mode {mode}"
    return (f"{line['verdict'].capitalize()}, mode {mode}: {float(line['frequency_hz']):.0f} Hz, "
            f"growth rate {float(line['growth_rate_1_per_s']):+.3g} 1/s")


def make_view(pv):
    view = pv.CreateView("RenderView")
    view.UseColorPaletteForBackground = 0
    view.BackgroundColorMode = "Single Color"
    view.Background = [1, 1, 1]
    view.OrientationAxesLabelColor = GREY
    return view


def look(view, bounds, direction):
    """Parallel to the direction (elevation, azimuth in degrees), the box in sight."""
    elevation, azimuth = (math.radians(value) for value in direction)
    eye = (math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation))
    centre = [(bounds[2 * i] + bounds[2 * i + 1]) / 2 for i in range(3)]
    size = math.dist(bounds[::2], bounds[1::2])
    view.CameraFocalPoint = centre
    view.CameraPosition = [c + 2 * size * e for c, e in zip(centre, eye)]
    view.CameraViewUp = [0, 1, 0] if elevation == math.pi / 2 else [0, 0, 1]
    view.CameraParallelProjection = 1
    view.CameraParallelScale = (0.55 if elevation == math.pi / 2 else 0.45) * size
    view.CenterOfRotation = centre


def label(pv, view, source, name, place):
    pv.RenameSource(name, source)
    display = pv.Show(source, view)
    display.WindowLocation = place
    display.FontSize = 14
    display.Color = GREY


def colour(pv, view, display, field, title, limits, preset):
    """Colours by the field's magnitude if it is a vector; the bar's title says the unit."""
    pv.ColorBy(display, field)
    table = pv.GetColorTransferFunction(field[1])
    table.AutomaticRescaleRangeMode = "Never"
    table.ApplyPreset(preset, True)
    table.RescaleTransferFunction(*limits)
    bar = pv.GetScalarBar(table, view)
    bar.Title, bar.ComponentTitle = title, ""
    bar.TitleColor = bar.LabelColor = GREY
    bar.Orientation, bar.WindowLocation = "Horizontal", "Lower Center"
    bar.ScalarBarLength, bar.TitleFontSize, bar.LabelFontSize = 0.6, 14, 14
    bar.Visibility = 1


def show_motion(pv, view, path, scale):
    """The bodies over one period."""
    reader = pv.PVDReader(registrationName=os.path.basename(path), FileName=path)
    reader.UpdatePipelineInformation()
    times = list(reader.TimestepValues)
    largest = 0
    for time in times:
        reader.UpdatePipeline(time)
        field = reader.PointData.GetArray("displacement_m")
        if field is None:
            fail(f"{path} has no field displacement_m; it has: {', '.join(reader.PointData.keys())}")
        largest = max(largest, field.GetRange(-1)[1])
    bounds = reader.GetDataInformation().GetBounds()
    diagonal = math.dist(bounds[::2], bounds[1::2])
    for name, side in (("rotor", 1), ("pads", 0)):
        # Not Threshold: in ParaView 5.11.0 (Debian 12) it crashes now and then on what was read from a .pvtu.
        body = pv.Clip(registrationName=name, Input=reader, ClipType="Scalar", Scalars=["POINTS", "body"], Value=0.5,
                       Invert=side)
        body.UpdatePipeline(times[0])
        if body.GetDataInformation().GetNumberOfCells() == 0:
            pv.Delete(body)
            continue
        # Cells do not share points in the file: weld them, or each would be lit as if it stood alone.
        welded = pv.CleantoGrid(registrationName=name + ", welded", Input=body)
        moved = pv.WarpByVector(registrationName=name + ", displaced", Input=welded, Vectors=["POINTS", "displacement_m"],
                                ScaleFactor=scale * diagonal / (largest or 1))
        display = pv.Show(moved, view)
        display.Ambient, display.Diffuse, display.Specular = 0.35, 0.7, 0
        colour(pv, view, display, ("POINTS", "displacement_m", "Magnitude"),
               "displacement of the mode, m (largest component = 1)", (0, largest or 1), "Viridis (matplotlib)")
    flat = bounds[5] - bounds[4] <= 1e-9 * diagonal
    look(view, bounds, (90, -90) if flat else (40, -65))
    phase = pv.AnnotateTimeFilter(Input=reader, Format="phase {time:.0f} degrees", Scale=360)
    label(pv, view, phase, "phase", "Upper Left Corner")
    return times


def show_faces(pv, view, path, field, title, preset):
    """A field on the pads' contact faces, which are moved apart."""
    reader = pv.XMLPartitionedUnstructuredGridReader(registrationName=os.path.basename(path), FileName=[path])
    reader.UpdatePipeline()
    array = reader.PointData.GetArray(field)
    if array is None:
        fail(f"{path} has no field {field}; it has: {', '.join(reader.PointData.keys())}")
    low, high = array.GetRange()
    if preset == "Cool to Warm":
        # Work: zero is in the middle. It is singular at the edges: colours end where a fiftieth of the nodes lies beyond.
        values = pv.servermanager.Fetch(reader).GetPointData().GetArray(field)
        sizes = sorted(abs(values.GetValue(i)) for i in range(values.GetNumberOfTuples()))
        high = sizes[len(sizes) * 98 // 100] or 1
        low = -high
    bounds = reader.GetDataInformation().GetBounds()
    shown = reader
    if bounds[5] > bounds[4]:
        lift = 0.25 * math.dist(bounds[:4:2], bounds[1:4:2]) - (bounds[5] - bounds[4]) / 2
        middle = (bounds[4] + bounds[5]) / 2
        shown = pv.Calculator(registrationName="faces moved apart", Input=reader, CoordinateResults=1,
                              ResultArrayName="moved",
                              Function=f"coords + {max(lift, 0):.6g}*if(coordsZ > {middle:.6g}, 1, -1)*kHat")
        shown.UpdatePipeline()
        bounds = shown.GetDataInformation().GetBounds()
    view.OrientationAxesVisibility = 0
    display = pv.Show(shown, view)
    display.Ambient, display.Diffuse, display.Specular = 0.6, 0.4, 0
    display.LineWidth = 6  # faces of a plane scene are lines
    colour(pv, view, display, ("POINTS", field), title, (low, high), preset)
    look(view, bounds, (35, 0) if bounds[5] > bounds[4] else (90, -90))


def write_state(pv, arguments, cycle, mode, words):
    pv._DisableFirstRenderCameraReset()
    directory = os.path.abspath(arguments.directory)
    faces = [(os.path.join(directory, f"mode-{cycle}-{mode:03d}-contact.pvtu"), "friction_work_j_per_m2",
              "work of friction, J/m^2 per cycle (unit modal mass; red feeds)", "Cool to Warm"),
             (os.path.join(directory, f"contact-{cycle}.pvtu"), "contact_pressure_pa", "steady contact pressure, Pa",
              "Inferno (matplotlib)")]
    faces = [face for face in faces if os.path.isfile(face[0])]
    layout = pv.CreateLayout("mode")
    view = make_view(pv)
    pv.AssignViewToLayout(view, layout, 0)
    right = layout.SplitHorizontal(0, 0.6) + 1 if faces else None
    times = show_motion(pv, view, os.path.join(directory, f"mode-{cycle}-{mode:03d}.pvd"), arguments.scale)
    label(pv, view, pv.Text(Text=words), "caption", "Upper Center")
    for number, face in enumerate(faces):
        beside = make_view(pv)
        where = right
        if number + 1 < len(faces):
            where = layout.SplitVertical(right, 0.5)
            right = where + 1
        pv.AssignViewToLayout(beside, layout, where)
        show_faces(pv, beside, *face)
    layout.SetSize(1600, 900)
    pv.SetActiveView(view)

    scene = pv.GetAnimationScene()
    scene.UpdateAnimationUsingDataTimeSteps()
    scene.PlayMode = "Snap To TimeSteps"
    scene.Loop = 1
    scene.AnimationTime = times[0]
    pv.SaveState(arguments.output)
    if not os.path.isfile(arguments.output):
        fail(f"{arguments.output} was not written; is the directory writable?")
    if arguments.picture:
        pv.SaveScreenshot(arguments.picture, layout, ImageResolution=[1600, 900])
        if not os.path.isfile(arguments.picture):
            fail(f"{arguments.picture} was not written; is the directory writable?")


def main():
    arguments = parse_arguments()
    modes = read_modes(arguments.directory, fail)
    cycle, mode, _ = choose_mode(arguments, modes, "pvd", ": run with Output/Fields other than none and "
                                 "Output/Animation frames above 0", fail)
    try:
        import paraview
        paraview.compatibility.major, paraview.compatibility.minor = 5, 11
        import paraview.simple as pv
    except ImportError as error:
        fail(f"ParaView cannot be loaded ({error}). Debian: scripts/install-dependencies.sh --pictures; "
             "start it as  xvfb-run -a pvbatch scripts/paraview_state.py ...")
    if not os.environ.get("DISPLAY"):
        fail("there is no display; start it as  xvfb-run -a pvbatch scripts/paraview_state.py ...")
    is_named = arguments.output is not None
    if not is_named:
        name = os.path.basename(os.path.abspath(arguments.directory))
        arguments.output = os.path.join(arguments.directory, name + ".pvsm")
    for output, named in ((arguments.output, is_named), (arguments.picture, True)):
        if output:
            refuse_foreign(output, named, fail, [b"<ParaView", b"<GenericParaView"])
    write_state(pv, arguments, cycle, mode, caption(mode, modes.get((cycle, mode))))
    print(f"paraview {arguments.output}")


main()
