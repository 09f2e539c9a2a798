// Removed as soon as this folder has a source of its own.
