"""What the scripts share: tools (running them), tables (CSV, Markdown, numbers), charts (one look), rotations."""
