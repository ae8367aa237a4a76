"""Events and observables of contacts, and families of formulations."""
