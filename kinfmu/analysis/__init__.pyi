"""The public names: the package imports each from where it is listed here, when it is first used."""

from kinfmu.analysis.assemblies import Assemblies as Assemblies
from kinfmu.analysis.cams import cam_profile as cam_profile
from kinfmu.analysis.certified.certificate import Certificate as Certificate
from kinfmu.analysis.certified.proving import certify as certify
from kinfmu.analysis.report import Report as Report
from kinfmu.analysis.report import check as check
