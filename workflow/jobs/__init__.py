"""The jobs of the workflow, what each reads, calls and writes; figures and pages of results that no command shows."""
