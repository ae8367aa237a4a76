"""What people and programs read: tables on the terminal, JSON, and one self-contained HTML file."""
