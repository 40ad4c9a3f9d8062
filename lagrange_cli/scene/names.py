from lagrange_cli.scene.model import Scene
from lagrange_cli.scene.problems import Problems
def check_names(scene: Scene, problems: Problems) -> None:
    pass
