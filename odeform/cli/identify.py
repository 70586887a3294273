"""`odeform identify`."""

import argparse

from odeform.cli.options import add_checkpoint, add_json, add_seed, add_split, positive, write_json
from odeform.errors import InputError

__all__ = ["HELP", "add_options", "run"]

HELP = "Estimate the parameters of observed motions, all together, with intervals"


def add_options(parser: argparse.ArgumentParser) -> None:
    add_checkpoint(parser)
    parser.add_argument("--data", metavar="DATASET", help="the observed motions: a folder, a file, or a bundled name")
    add_split(parser)
    parser.add_argument("--limit", type=int, metavar="N", help="use the first N sequences (default: all)")
    parser.add_argument(
        "--points", type=int, metavar="N", help="observe N random points of the surface (default: the vertices)"
    )
    parser.add_argument("--frames", type=int, metavar="K", help="observe K random frames (default: all)")
    parser.add_argument(
        "--noise", type=float, default=0.0, metavar="MM", help="noise to add to each coordinate, in mm (default: 0)"
    )
    add_seed(parser, "points, frames and noise")
    _add_pushed(parser)
    add_json(parser)


def _add_pushed(parser: argparse.ArgumentParser) -> None:
    pushed = parser.add_argument_group("pushed bodies", "of models such as contact-force, in place of --data")
    pushed.add_argument("--drawn", type=int, metavar="N", help="identify N drawn bodies of each object")
    pushed.add_argument("--object", nargs="+", metavar="NAME", help="these objects only (default: all)")
    pushed.add_argument("--simulated", action="store_true", help="the simulator moves them (default: the model itself)")
    pushed.add_argument("--simulations", type=int, metavar="N",
                        help="correct the model by N simulations of each body, each of the last estimate")  # fmt: skip
    pushed.add_argument("--cloud", action="store_true", help="observe --points of half of the surface in each frame, "
                        "without correspondence, from an unknown place (default: 200 points)")  # fmt: skip
    pushed.add_argument(
        "--next",
        action="store_true",
        help="count the pushes, drops and throws that halve the widest interval, the best "
        "against random; with --simulated, how far each leads from the true body",
    )
    pushed.add_argument("--with", nargs="+", default=[], choices=("drop", "throw"), metavar="LOAD", dest="falls",
                        help="each body also falls so: drop, throw; with --known push")  # fmt: skip
    choices = ("mass", "young", "friction", "push")
    pushed.add_argument("--known", nargs="+", default=[], choices=choices, metavar="NAME",
                        help="what is known: mass, young, friction, push (contact and force)")  # fmt: skip


def run(args: argparse.Namespace) -> None:
    from odeform.models.registry import load

    for name in ("limit", "drawn", "simulations"):
        if (count := getattr(args, name)) is not None:
            positive(f"--{name}", count)
    if (args.data is None) == (args.drawn is None):
        raise InputError("identify: expected either --data or --drawn")
    predictor = load(args.checkpoint)
    if args.drawn is not None:
        from odeform.identification.pushed.halving import halve_drawn, report_halved
        from odeform.identification.pushed.misled import misled_drawn, report_misled
        from odeform.identification.pushed.table import identify_drawn, report_drawn
        from odeform.identification.pushed.views import CloudView

        view = CloudView(points=args.points or CloudView.points) if args.cloud else None
        objects = args.object or predictor.schema.objects
        for name in objects:
            predictor.schema.check_object(name)
        if args.next and args.simulated:
            misled = misled_drawn(predictor, objects, args.drawn, args.noise, args.seed)
            write_json(misled, args.json)
            print(report_misled(misled))
            return
        if args.next:
            halved = halve_drawn(predictor, objects, args.drawn, args.noise, args.seed)
            write_json(halved, args.json)
            print(report_halved(halved))
            return
        result = identify_drawn(
            predictor,
            objects,
            args.drawn,
            view,
            args.noise,
            args.seed,
            args.simulated,
            args.known,
            args.simulations or 0,
            args.falls,
        )
        write_json(result, args.json)
        print(report_drawn(result))
        return
    from odeform.dataset.store import open_dataset
    from odeform.identification.observation import View
    from odeform.identification.table import identify_split, report

    view = View(args.points, args.frames, args.noise, args.seed)
    result = identify_split(predictor, open_dataset(args.data), args.split, args.limit, view)
    write_json(result, args.json)
    print(report(result))
