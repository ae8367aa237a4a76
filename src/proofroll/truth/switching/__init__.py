"""Parts that both routes of a truth with contacts and joint laws share: guards, stretches, compiled modes."""
