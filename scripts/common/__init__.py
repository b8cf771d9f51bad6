"""What the scripts share: running tools, tables and numbers, the look of charts."""
