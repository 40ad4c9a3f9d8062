from lagrange_cli.simulate.integrators.base import Integrator


class Gauss16(Integrator):
    name = "Gauss16"
