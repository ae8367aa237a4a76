"""Articles that are reproduced and checked: each a plug-in that nothing else imports."""
