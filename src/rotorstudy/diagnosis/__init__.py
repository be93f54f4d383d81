"""Measured data in, the missing cause out: what a model gets wrong, why, and what repairing it gains."""

from rotorstudy.diagnosis.result import Verdict as Verdict
from rotorstudy.diagnosis.settings import Settings as Settings
from rotorstudy.diagnosis.verdict import Diagnosis as Diagnosis
from rotorstudy.diagnosis.verdict import diagnose as diagnose
from rotorstudy.diagnosis.verdict import investigate as investigate
