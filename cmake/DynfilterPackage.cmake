# The package: one export set a component, so that a header-only install needs nothing of the
# others; a config that finds its own dependencies; usable from the build tree and when moved.
