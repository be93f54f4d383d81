"""Diagnosis: what a model lacks to explain measured vibration, the cause, and the gain of adding it."""

from rotorstudy.diagnosis.result import Verdict as Verdict
from rotorstudy.diagnosis.settings import Settings as Settings
from rotorstudy.diagnosis.verdict import Diagnosis as Diagnosis
from rotorstudy.diagnosis.verdict import diagnose as diagnose
from rotorstudy.diagnosis.verdict import investigate as investigate
