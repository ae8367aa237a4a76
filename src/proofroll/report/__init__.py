"""Reports for people and programs: tables on the terminal, JSON, and one self-contained HTML file."""
