"""The search: sets of mechanisms and artefacts, fitted one after another to every fibre of a study."""
