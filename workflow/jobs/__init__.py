"""The jobs of the workflow: what each reads, which function it calls, what it writes."""
