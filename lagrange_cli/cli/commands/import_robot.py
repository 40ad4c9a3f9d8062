"""``lagrange import``: a scene from the description of a robot."""

from __future__ import annotations

import click

from lagrange_cli.api.starter import imported_scene
from lagrange_cli.cli import options
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command, heading
from lagrange_cli.cli.terminal.output import print_text
from lagrange_cli.files import write_file


@click.command("import", cls=Command)
@click.argument("robot", type=click.Path(allow_dash=True))
@heading("Scene")
@click.option("--limits", is_flag=True, help="Make limits of joints one-sided constraints.")
@click.option("--floating", is_flag=True, help="Let the root move freely in space.")
@heading("Output")
@options.file(
    "-o --output",
    "Write this .yaml file.  [default: print it]",
    callback=options.writable_as(".yaml", ".yml"),
)
@options.common
@click.pass_obj
def import_robot(
    session: Session, /, robot: str, limits: bool, floating: bool, output: str | None
) -> None:
    """Write a scene from ROBOT, a URDF or MJCF file or - for standard input.

    What a scene does not say is listed on stderr: meshes, contacts, sensors."""
    scene = imported_scene(robot, limits=limits, floating=floating)
    session.tell(scene.warnings, scene.remarks)
    if output is None:
        print_text(scene.text, "text")
    else:
        write_file(output, scene.text)
        session.remark(f"wrote {output}")
