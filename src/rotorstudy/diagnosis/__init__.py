"""Diagnosis: what a model lacks to explain measured vibration, the cause, and the gain of adding it."""

from rotorstudy.diagnosis.settings import Settings as Settings
from rotorstudy.diagnosis.verdict.investigate import Diagnosis as Diagnosis
from rotorstudy.diagnosis.verdict.investigate import diagnose as diagnose
from rotorstudy.diagnosis.verdict.investigate import investigate as investigate
from rotorstudy.diagnosis.verdict.result import Verdict as Verdict
