"""The public names: the package imports each from where it is listed here, when it is first used."""

from kinfmu.draw.animation import animate as animate
from kinfmu.draw.cam_figure import cam as cam
from kinfmu.draw.drawing import figure as figure
from kinfmu.draw.dxf_file import dxf as dxf
from kinfmu.draw.plots import plot as plot
from kinfmu.draw.svaj_figure import svaj as svaj
