"""The Pinocchio twin, closed configurations, the relation between platform and observation, the certificate."""
